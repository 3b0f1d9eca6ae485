"""Converts a fitted sum of terms (symbolic regression) into a law that can be simulated, and into a hypothesis.

The search for unknown physics fits a sum  factor_1 term_1 + factor_2 term_2 + … (`fit_sum`) with signals named x, y, z
by their order. A simulation needs a formula in the language of laws (`equalizer.laws`), with parameters p0, p1, … and
the recording's own names for the signals.
"""

import re
from collections.abc import Sequence
from dataclasses import replace

from analysis.diagnosis.discovery.fit_sum import Sum
from analysis.diagnosis.discovery.grammar import AXES, CONSTANT
from analysis.diagnosis.errors.hypothesis import Hypothesis, combine_hypotheses
from analysis.diagnosis.errors.law_hypothesis import make_law_hypothesis
from equalizer.effects.discovered_law import collect_channels, derive_axis_letters, has_memory, list_response_signals
from equalizer.laws.law import Law
from equalizer.signals.recording import Recording

_PARAMETER_PATTERN = re.compile(r"\bp(\d+)\b")
"""Pattern of a free parameter, such as p0, in the formula of a term."""
_SIGNAL_PATTERN = re.compile(rf"\b(v|f|a|dv|)([{AXES}])\b")
"""Pattern of a signal in the grammar's names: position x, velocity vx, acceleration dvx, command fx, reading (response)
ax."""


def convert_sum_to_law(term_sum: Sum, recording: Recording) -> Law:
    """Convert a sum to a law with parameters in SI units: p0 is the first term's factor, followed by that term's own
    parameters, then the factor and parameters of the next term. Signals get the recording's names. A force that depends
    on commands alone and has no memory becomes a law of the command, f + sum, because such a law can be inverted."""
    channels = collect_channels(recording)
    axis_names_in_law, reading_names = derive_axis_letters(channels.inputs), list_response_signals(channels)
    term_formulas: list[str] = []
    parameters: list[float] = []
    for term, factor in zip(term_sum.terms, term_sum.factors, strict=True):
        first_index = len(parameters)
        parameters += [factor, *term.numbers]
        shape = _renumber_parameters(term.shape, first_index + 1)
        term_formulas.append(f"p{first_index}" if shape == CONSTANT else f"p{first_index}*{shape}")

    def use_recording_name(match: re.Match[str]) -> str:
        axis_index = AXES.index(match[2])
        if match[1] == "a":
            return reading_names[axis_index]
        return match[1].replace("dv", "a") + axis_names_in_law[axis_index]

    formula = _SIGNAL_PATTERN.sub(use_recording_name, " + ".join(term_formulas))
    if term_sum.acts_on == "response":
        axis_name = derive_axis_letters(channels.outputs)[term_sum.axis]
        return Law(f"{reading_names[term_sum.axis]} + {formula}", tuple(parameters), (), "response", axis_name)
    law = Law(formula, tuple(parameters), (), "force", axis_names_in_law[term_sum.axis])
    is_of_commands = bool(term_sum.variables) and all(name.startswith("f") for name in term_sum.variables)
    if is_of_commands and not has_memory(law):
        return replace(law, expression=f"f{axis_names_in_law[term_sum.axis]} + {formula}", acts_on="command")
    return law


def _renumber_parameters(shape: str, first_index: int) -> str:
    """Renumber the parameters p0, p1, … of a term's formula from `first_index` on."""
    return _PARAMETER_PATTERN.sub(lambda match: f"p{int(match[1]) + first_index}", shape)


def convert_sum_to_hypothesis(term_sum: Sum, recording: Recording) -> Hypothesis:
    """Convert a sum to a hypothesis that can be simulated: a claim for the sum, and a claim for its partner on another
    axis (antisymmetric pair) if there is one."""
    hypothesis = make_law_hypothesis(convert_sum_to_law(term_sum, recording), term_sum.axis, recording)
    return (
        hypothesis
        if term_sum.partner is None
        else combine_hypotheses(hypothesis, convert_sum_to_hypothesis(term_sum.partner, recording))
    )


def list_fitted_laws(hypothesis: Hypothesis) -> tuple[Law | None, ...]:
    """List the discovered law of each claim with its fitted parameters; None for an effect of the catalogue."""
    return tuple(
        None
        if claim.effect.law is None
        else claim.effect.law.replace_numbers(_list_values_in_order(hypothesis.list_effects_of(claim_index)[0].values))
        for claim_index, claim in enumerate(hypothesis.claims)
    )


def _list_values_in_order(values: object) -> Sequence[float]:
    """List the values of p0, p1, … in this order. values: dict of all of them by parameter name."""
    assert isinstance(values, dict)
    return [values[f"p{index}"] for index in range(len(values))]
