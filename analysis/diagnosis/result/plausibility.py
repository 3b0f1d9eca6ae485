"""Check whether the results of a diagnosis are physically plausible, and write a sentence for the report per doubt.

Doubts are: a parameter at the bound of its fit, static friction below Coulomb friction, a confidence interval that
contains the value without the effect, negative damping or stiffness of the improved model (not passive, or unstable),
and a law of the force balance whose strength differs between the parts of the recordings.
"""

import math
from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

import numpy as np

from analysis.diagnosis.document import NamedEffect
from analysis.diagnosis.effect_words import get_noun
from analysis.diagnosis.limits import STILL_SHARE
from analysis.diagnosis.result.findings import Findings
from analysis.diagnosis.unit_wording import format_error, format_value
from analysis.wording import conjoin
from equalizer.effects.effect import Parameter, PlacedEffect
from equalizer.effects.placing import shorten_axis_name
from equalizer.plant.effect_vocabulary import EFFECTS_BY_NAME, RESPONSE
from equalizer.plant.mechanical_model import MechanicalModel
from equalizer.signals.signal import FloatArray

if TYPE_CHECKING:
    from analysis.diagnosis.balance.judge_laws import Balance
    from analysis.diagnosis.balance.judged_law import JudgedLaw
    from analysis.diagnosis.balance.regression import Regression

_BOUND_TOLERANCE = 1e-3
"""Relative distance from a bound within which a parameter counts as at that bound. Chosen."""
_MOST_LISTED_PARTS = 8
"""Largest number of parts whose values are listed; of more, the lowest and the highest. Chosen."""
_EIGENVALUE_ROUNDING = 1e-6
"""Magnitude of a negative eigenvalue that rounding may cause, relative to the largest eigenvalue. Chosen."""


def describe_doubts(findings: Findings) -> tuple[str, ...]:
    """Describe, in sentences, implausible parameters of the named effects, their intervals, and the improved model."""
    return (
        *(sentence for placed_effect in findings.named for sentence in _check_effect(placed_effect, findings)),
        *(sentence for effect in findings.diagnosis.effects for sentence in _check_interval(effect, findings.named)),
        *_check_model(findings.improved),
    )


def _check_effect(placed_effect: PlacedEffect, findings: Findings) -> Iterator[str]:
    """Check for fitted parameters at a bound, and for friction that is smaller at rest than in motion; one sentence
    each."""
    noun, values = get_noun(placed_effect.effect.name), placed_effect.values
    for parameter in placed_effect.effect.parameters:
        value = values[parameter.name]
        if not parameter.fixed and _is_at_bound(value, parameter):
            text = format_value(value, _find_unit(placed_effect.effect.name, parameter.name, findings))
            yield (
                f"The {parameter.name.replace('_', ' ')} of {noun} reached the limit of its allowed range ({text}): "
                "the fit has not found a best value."
            )
    if placed_effect.effect.name == "stribeck_friction" and values["static"] < values["coulomb"]:
        yield "The fitted friction is smaller at rest than in motion, which is rare for real surfaces."


def _is_at_bound(value: float, parameter: Parameter) -> bool:
    """Whether a parameter is at a bound of its fit. A bound of 0 is not checked, nor one at which the effect
    vanishes."""
    bounds = [bound for bound in (parameter.lower, parameter.upper) if bound != parameter.none]
    return any(np.isclose(value, bound, rtol=_BOUND_TOLERANCE, atol=0.0) for bound in bounds if bound)


def _check_interval(effect: NamedEffect, placed_effects: Sequence[PlacedEffect]) -> Iterator[str]:
    """Check whether the 95 % interval of an effect's main parameter contains the value without the effect; a sentence
    if so. placed_effects: the named effects, for their parameters."""
    placed_effect = next(
        (placed_effect for placed_effect in placed_effects if placed_effect.effect.name == effect.effect), None
    )
    for parameter in placed_effect.effect.parameters[:1] if placed_effect is not None else ():
        estimate = effect.parameters.get(parameter.name)
        if estimate is None or estimate.ci95 is None or parameter.none is None:
            continue
        low, high = estimate.ci95
        if low <= parameter.none <= high:
            text = format_value(estimate.value, estimate.unit, estimate.ci95)
            yield (
                f"The interval of {get_noun(effect.effect)}, {text}, includes the value without the effect: the data "
                "hardly support it."
            )


def _check_model(improved: MechanicalModel) -> Iterator[str]:
    """Check damping and stiffness matrix for a negative eigenvalue beyond rounding; a sentence each."""
    for name, matrix in (("damping", improved.damping), ("stiffness", improved.stiffness)):
        lowest_eigenvalue, largest_magnitude = _compute_extreme_eigenvalues(matrix)
        if lowest_eigenvalue < -_EIGENVALUE_ROUNDING * max(largest_magnitude, 1e-300):
            consequence = (
                "would generate energy"
                if name == "damping"
                else "would move away from its position of rest without a force"
            )
            yield f"The improved model's {name} is negative in one direction: in it, the device {consequence}."


def describe_changed_strengths(
    effects: Sequence[NamedEffect], balances: "Sequence[Balance]", channels: tuple[str, ...]
) -> tuple[str, ...]:
    """Describe, in a sentence each, named laws whose strength differs between the parts of the recordings. channels:
    names of the commands, in the order of the balances."""
    return tuple(
        sentence
        for channel, balance in zip(channels, balances, strict=False)
        for judged_law in balance.named
        for effect in effects
        if effect.effect == judged_law.simulated_as and effect.axis in (shorten_axis_name(channel, channels), None, "")
        for sentence in _compare_parts(effect, judged_law, balance)
    )


def _compare_parts(effect: NamedEffect, judged_law: "JudgedLaw", balance: "Balance") -> Iterator[str]:
    """Compare the strengths of a law of one column, fitted to each part (motion) in which it acts (`_list_parts`): a
    sentence where separate values reduce the error of the held-out samples significantly."""
    from analysis.diagnosis.balance.structures import Structure, improves_significantly

    regression, laws = balance.search.regression, balance.chosen.laws
    if judged_law.law_index not in laws:  # a law of the command has no column
        return
    column_range, columns = regression.column_ranges[judged_law.law_index], regression.select_columns(laws)
    parts = _list_parts(regression, column_range.start)
    if column_range.stop - column_range.start != 1 or len(parts) < 2:
        return
    strength = _find_strength(effect, judged_law, regression)
    common_errors = regression.compute_test_errors(columns)
    common_weight = float(regression.fit_weights(columns)[columns.index(column_range.start)])
    weights, errors = regression.fit_weight_by_motion(columns, column_range.start)
    if strength and common_weight and improves_significantly(Structure(laws, common_errors), Structure(laws, errors)):
        estimate = effect.parameters[strength]
        values = [estimate.value * float(weights[part]) / common_weight for part in parts]
        ends = f"between {format_value(min(values), estimate.unit)} and {format_value(max(values), estimate.unit)}"
        listed = conjoin([format_value(value, estimate.unit) for value in values])
        power = sum(block.centred_power for block in regression.test)
        before, after = (format_error(float(np.sqrt(e.sum() / power))) for e in (common_errors, errors))
        name = f"{strength.replace('_', ' ')} of {get_noun(effect.effect)}"
        yield (
            f"Fitted separately to each of the {len(parts)} parts, the {name} is "
            f"{listed if len(parts) <= _MOST_LISTED_PARTS else ends}, and the error of the force balance falls from "
            f"{before} to {after}: something that was not recorded changed between the parts, or the law depends on "
            "the motion in another way."
        )


def _list_parts(regression: "Regression", column: int) -> list[int]:
    """List the parts (indices of motions) with samples to fit and to test in which a law's column acts: its mean square
    over the samples to fit is above `STILL_SHARE` of that in the part where it is largest."""
    power: dict[int, float] = {}
    for part in {block.motion_index for block in regression.test}:
        blocks = [block for block in regression.fit if block.motion_index == part]
        if blocks:
            power[part] = sum(float(b.gram[column, column]) for b in blocks) / sum(len(b.rows) for b in blocks)
    return sorted(part for part, part_power in power.items() if part_power > STILL_SHARE * max(power.values()))


def _find_strength(effect: NamedEffect, judged_law: "JudgedLaw", regression: "Regression") -> str:
    """Find the effect's first parameter that is proportional to the weight of the law's single column, as the stiffness
    of an end stop is, but not its position; empty without one, and for a formula."""
    if judged_law.formula is not None:
        return ""
    law, columns = judged_law.law, regression.select_columns((judged_law.law_index,))
    weights = regression.fit_weights(columns)
    mass = float(weights[regression.base_terms.driven_channel]) if regression.mass is None else regression.mass
    whole, half = (law.convert_weights(factor * weights[-1:], law.numbers, mass) or {} for factor in (1.0, 0.5))
    proportional = (name for name, value in whole.items() if value and math.isclose(half.get(name, value), value / 2))
    return next((name for name in proportional if name in effect.parameters), "")


def _compute_extreme_eigenvalues(matrix: FloatArray) -> tuple[float, float]:
    """Compute the lowest eigenvalue, and the largest magnitude of an eigenvalue, of the symmetric part of a matrix."""
    eigenvalues = np.linalg.eigvalsh((matrix + matrix.T) / 2)
    return float(eigenvalues[0]), float(np.abs(eigenvalues).max())


def _find_unit(effect: str, parameter: str, findings: Findings) -> str:
    """Find the unit of an effect's parameter in the given model's unit system; "1" where it is not in the
    vocabulary."""
    entry = EFFECTS_BY_NAME.get(effect)
    for known_parameter in entry.parameters if entry else ():
        if known_parameter.name == parameter:
            response = findings.time_series[0].units[0] if findings.time_series else RESPONSE
            return known_parameter.find_unit(findings.given.system, response)
    return "1"
