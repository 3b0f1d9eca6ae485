"""Turns a sum of terms into a law that can be simulated, and a hypothesis into its laws."""

import re
from collections.abc import Sequence

from analysis.diagnosis.discovery.fit_sum import Sum
from analysis.diagnosis.discovery.grammar import AXES
from analysis.diagnosis.errors.hypothesis import Hypothesis
from equalizer.effects.discovered_law import axis_names
from equalizer.laws.law import Law
from equalizer.signals.recording import Recording

_NUMBER = re.compile(r"\bp(\d+)\b")
_SIGNAL = re.compile(rf"\b([vf]?)([{AXES}])\b")


def law_of_sum(of: Sum, recording: Recording) -> Law:
    """The sum as a law: p0 is the first term's factor, then its numbers, then the next term's. The grammar calls the
    driven axes x, y, z in their order; the law calls them as the recording does."""
    names = axis_names(recording.command.channels)
    parts: list[str] = []
    numbers: list[float] = []
    for term, factor in zip(of.terms, of.factors, strict=True):
        first = len(numbers)
        numbers += [factor, *term.numbers]
        parts.append(f"p{first}*{_renumber(term.shape, first + 1)}")
    text = _SIGNAL.sub(lambda found: found[1] + names[AXES.index(found[2])], " + ".join(parts))
    return Law(text, tuple(numbers), (), "force", names[of.axis])


def _renumber(shape: str, first: int) -> str:
    return _NUMBER.sub(lambda found: f"p{int(found[1]) + first}", shape)


def laws_of(hypothesis: Hypothesis) -> tuple[Law | None, ...]:
    """Per claim, with its numbers as they are fitted; None for what has a name."""
    return tuple(
        None
        if claim.effect.law is None
        else claim.effect.law.with_numbers(_numbers_in_order(hypothesis.of_claim(number)[0].values))
        for number, claim in enumerate(hypothesis.claims)
    )


def _numbers_in_order(values: object) -> Sequence[float]:
    assert isinstance(values, dict)
    return [values[f"p{place}"] for place in range(len(values))]
