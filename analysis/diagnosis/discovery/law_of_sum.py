"""Conversion of a fitted sum of terms into a law that can be simulated, and of a hypothesis into its laws.

The search for unknown physics fits a sum  factor_1 term_1 + factor_2 term_2 + … (`fit_sum`) with signals named x, y, z
by their order. A simulation needs a formula in the language of laws (`equalizer.laws`), with parameters p0, p1, … and
the recording's own names for the signals.
"""

import re
from collections.abc import Sequence
from dataclasses import replace

from analysis.diagnosis.discovery.fit_sum import Sum
from analysis.diagnosis.discovery.grammar import AXES
from analysis.diagnosis.errors.hypothesis import Hypothesis, combine
from analysis.diagnosis.errors.law_hypothesis import hypothesis_of_law
from equalizer.effects.discovered_law import axis_names, has_memory, law_channels, names_of_readings
from equalizer.laws.law import Law
from equalizer.signals.recording import Recording

_NUMBER = re.compile(r"\bp(\d+)\b")
"""A free parameter, such as p0, in the formula of a term."""
_SIGNAL = re.compile(rf"\b([vfa]?)([{AXES}])\b")
"""A signal in the grammar's names: position x, velocity vx, command fx, reading ax."""


def law_of_sum(of: Sum, recording: Recording) -> Law:
    """The sum as a law with parameters in SI units: p0 is the first term's factor, followed by that term's own
    parameters, then the next term's. Signals get the recording's names. A force that depends on commands alone and has
    no memory becomes a law of the command, f + sum, because such a law can be inverted."""
    channels = law_channels(recording)
    names, readings = axis_names(channels.inputs), names_of_readings(channels)
    parts: list[str] = []
    numbers: list[float] = []
    for term, factor in zip(of.terms, of.factors, strict=True):
        first = len(numbers)
        numbers += [factor, *term.numbers]
        parts.append(f"p{first}*{_renumber(term.shape, first + 1)}")

    def rename(found: re.Match[str]) -> str:
        place = AXES.index(found[2])
        return readings[place] if found[1] == "a" else found[1] + names[place]

    text = _SIGNAL.sub(rename, " + ".join(parts))
    if of.acts_on == "response":
        letter = axis_names(channels.outputs)[of.axis]
        return Law(f"{readings[of.axis]} + {text}", tuple(numbers), (), "response", letter)
    law = Law(text, tuple(numbers), (), "force", names[of.axis])
    if all(name.startswith("f") for name in of.variables) and not has_memory(law):
        return replace(law, expression=f"f{names[of.axis]} + {text}", acts_on="command")
    return law


def _renumber(shape: str, first: int) -> str:
    """Formula of a term with its parameters p0, p1, … renumbered from `first` on."""
    return _NUMBER.sub(lambda found: f"p{int(found[1]) + first}", shape)


def hypothesis_of_sum(of: Sum, recording: Recording) -> Hypothesis:
    """The sum as a hypothesis to simulate: one claim, and one more for its partner on another axis if there is one."""
    own = hypothesis_of_law(law_of_sum(of, recording), of.axis, recording)
    return own if of.partner is None else combine(own, hypothesis_of_sum(of.partner, recording))


def laws_of(hypothesis: Hypothesis) -> tuple[Law | None, ...]:
    """Law of each claim with its fitted parameters; None for a claim whose effect is in the catalogue."""
    return tuple(
        None
        if claim.effect.law is None
        else claim.effect.law.with_numbers(_values_in_order(hypothesis.of_claim(number)[0].values))
        for number, claim in enumerate(hypothesis.claims)
    )


def _values_in_order(values: object) -> Sequence[float]:
    """Values of p0, p1, … in this order."""
    assert isinstance(values, dict)
    return [values[f"p{place}"] for place in range(len(values))]
