"""Convert a discovered law, a formula that is no effect of the catalogue, to a hypothesis that `output_error` can fit.

The free numbers of the formula become the parameters of an effect (`make_law_effect`) at one axis or response channel.
"""

from analysis.diagnosis.errors.hypothesis import Claim, Hypothesis, make_claim_hypothesis
from equalizer.effects.discovered_law import collect_channels, get_law_values, make_law_effect
from equalizer.laws.law import Law
from equalizer.signals.recording import Recording


def make_law_hypothesis(law: Law, axis: int, recording: Recording) -> Hypothesis:
    """Make the hypothesis with a single claim: the law at an axis, or at a channel for a law of the response. The fit
    starts from the numbers of the law. axis: index of the axis or channel, from 0."""
    effect = make_law_effect(law, collect_channels(recording))
    return make_claim_hypothesis(Claim(effect, "one", (axis,)), [get_law_values(law)])
