"""A sum of terms as a law that a simulation plays, and as a hypothesis that is fitted by output error."""

import re
from collections.abc import Sequence

from analysis.diagnosis.discovery.grammar import AXES
from analysis.diagnosis.discovery.sums import Sum
from analysis.diagnosis.errors.hypothesis import Claim, Hypothesis, claimed
from equalizer.effects.discovered_law import Channels, axis_names, law_effect, law_values
from equalizer.laws.law import Law
from equalizer.signals.recording import Recording

_NUMBER = re.compile(r"\bp(\d+)\b")
_SIGNAL = re.compile(rf"\b([vf]?)([{AXES}])\b")


def law_of_sum(of: Sum, recording: Recording) -> Law:
    """p0 is the first term's factor, then its numbers, then the next term's. The grammar calls the driven axes x, y, z
    in their order; the law calls them as the recording does."""
    names = axis_names(recording.command.channels)
    parts: list[str] = []
    numbers: list[float] = []
    for term, factor in zip(of.terms, of.factors, strict=True):
        first = len(numbers)
        numbers += [factor, *term.numbers]
        parts.append(f"p{first}*{_numbered(term.shape, first + 1)}")
    text = _SIGNAL.sub(lambda found: found[1] + names[AXES.index(found[2])], " + ".join(parts))
    return Law(text, tuple(numbers), (), "force", names[of.axis])


def _numbered(shape: str, first: int) -> str:
    return _NUMBER.sub(lambda found: f"p{int(found[1]) + first}", shape)


def hypothesis_of(law: Law, axis: int, recording: Recording) -> Hypothesis:
    effect = law_effect(law, channels_of(recording))
    return claimed(Claim(effect, "one", (axis,)), [law_values(law)])


def channels_of(recording: Recording) -> Channels:
    response = recording.response
    return Channels(recording.command.channels, response.channels, response.quantities[0])


def laws_of(hypothesis: Hypothesis) -> tuple[Law | None, ...]:
    """Per claim, with its numbers as they are fitted; None for what has a name."""
    return tuple(
        None
        if claim.effect.law is None
        else claim.effect.law.with_numbers(_in_order(hypothesis.of_claim(number)[0].values))
        for number, claim in enumerate(hypothesis.claims)
    )


def _in_order(values: object) -> Sequence[float]:
    assert isinstance(values, dict)
    return [values[f"p{place}"] for place in range(len(values))]
