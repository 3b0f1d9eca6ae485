"""A law without a name as a hypothesis, to be fitted by output error."""

from analysis.diagnosis.errors.hypothesis import Claim, Hypothesis, hypothesis_of_claim
from equalizer.effects.discovered_law import law_channels, law_effect, law_values
from equalizer.laws.law import Law
from equalizer.signals.recording import Recording


def hypothesis_of_law(law: Law, axis: int, recording: Recording) -> Hypothesis:
    """Hypothesis with a single claim, the law on axis (or channel) `axis`, which starts from the law's own
    parameters."""
    effect = law_effect(law, law_channels(recording))
    return hypothesis_of_claim(Claim(effect, "one", (axis,)), [law_values(law)])
