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
from equalizer.effects.discovered_law import axis_names, has_memory, law_channels, response_signal_names
from equalizer.laws.law import Law
from equalizer.signals.recording import Recording

_NUMBER = re.compile(r"\bp(\d+)\b")
"""A free parameter, such as p0, in the formula of a term."""
_SIGNAL = re.compile(rf"\b([vfa]?)([{AXES}])\b")
"""A signal in the grammar's names: position x, velocity vx, command fx, reading ax."""


def convert_sum_to_law(term_sum: Sum, recording: Recording) -> Law:
    """The sum as a law with parameters in SI units: p0 is the first term's factor, followed by that term's own
    parameters, then the next term's. Signals get the recording's names. A force that depends on commands alone and has
    no memory becomes a law of the command, f + sum, because such a law can be inverted."""
    channels = law_channels(recording)
    axes, readings = axis_names(channels.inputs), response_signal_names(channels)
    term_texts: list[str] = []
    parameters: list[float] = []
    for term, factor in zip(term_sum.terms, term_sum.factors, strict=True):
        first_index = len(parameters)
        parameters += [factor, *term.numbers]
        term_texts.append(f"p{first_index}*{_renumber(term.shape, first_index + 1)}")

    def rename(match: re.Match[str]) -> str:
        axis = AXES.index(match[2])
        return readings[axis] if match[1] == "a" else match[1] + axes[axis]

    text = _SIGNAL.sub(rename, " + ".join(term_texts))
    if term_sum.acts_on == "response":
        axis_name = axis_names(channels.outputs)[term_sum.axis]
        return Law(f"{readings[term_sum.axis]} + {text}", tuple(parameters), (), "response", axis_name)
    law = Law(text, tuple(parameters), (), "force", axes[term_sum.axis])
    if all(name.startswith("f") for name in term_sum.variables) and not has_memory(law):
        return replace(law, expression=f"f{axes[term_sum.axis]} + {text}", acts_on="command")
    return law


def _renumber(shape: str, first: int) -> str:
    """Formula of a term with its parameters p0, p1, … renumbered from `first` on."""
    return _NUMBER.sub(lambda match: f"p{int(match[1]) + first}", shape)


def convert_sum_to_hypothesis(term_sum: Sum, recording: Recording) -> Hypothesis:
    """The sum as a hypothesis to simulate: one claim, and one more for its partner on another axis if there is one."""
    hypothesis = hypothesis_of_law(convert_sum_to_law(term_sum, recording), term_sum.axis, recording)
    return (
        hypothesis
        if term_sum.partner is None
        else combine(hypothesis, convert_sum_to_hypothesis(term_sum.partner, recording))
    )


def list_fitted_laws(hypothesis: Hypothesis) -> tuple[Law | None, ...]:
    """Per claim, its discovered law with fitted parameters; None for a claim whose effect is in the catalogue."""
    return tuple(
        None
        if claim.effect.law is None
        else claim.effect.law.with_numbers(_order_values(hypothesis.list_effects_of(index)[0].values))
        for index, claim in enumerate(hypothesis.claims)
    )


def _order_values(values: object) -> Sequence[float]:
    """Values of p0, p1, … in this order. values: by parameter name."""
    assert isinstance(values, dict)
    return [values[f"p{index}"] for index in range(len(values))]
