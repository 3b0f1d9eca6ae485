"""Checks whether the results of a diagnosis are physically plausible; one sentence for the report per doubt.

Doubts are: a parameter at the bound of its fit, static friction below Coulomb friction, a confidence interval that
contains the value without the effect, and negative damping or stiffness of the improved model (not passive, or
unstable).
"""

from collections.abc import Iterator, Sequence

import numpy as np

from analysis.diagnosis.document import NamedEffect
from analysis.diagnosis.effect_words import noun_of
from analysis.diagnosis.result.findings import Findings
from analysis.diagnosis.unit_wording import value_text
from equalizer.effects.effect import Parameter, PlacedEffect
from equalizer.plant.effect_vocabulary import EFFECTS_BY_NAME, RESPONSE
from equalizer.plant.mechanical_model import MechanicalModel
from equalizer.signals.signal import FloatArray

_BOUND_TOLERANCE = 1e-3
"""Relative distance from a bound within which a parameter counts as at that bound."""
_EIGENVALUE_ROUNDING = 1e-6
"""Magnitude of a negative eigenvalue that rounding may cause, relative to the largest eigenvalue."""


def implausible_sentences(findings: Findings) -> tuple[str, ...]:
    """Sentences on implausible parameters of the named effects, on their intervals, and on the improved model."""
    return (
        *(sentence for placed in findings.named for sentence in _effect_doubts(placed, findings)),
        *(sentence for effect in findings.diagnosis.effects for sentence in _interval_doubts(effect, findings.named)),
        *_model_doubts(findings.improved),
    )


def _effect_doubts(placed: PlacedEffect, findings: Findings) -> Iterator[str]:
    """Sentences on fitted parameters at a bound, and on friction that is smaller at rest than in motion."""
    noun, values = noun_of(placed.effect.name), placed.values
    for parameter in placed.effect.parameters:
        value = values[parameter.name]
        if not parameter.fixed and _is_at_bound(value, parameter):
            text = value_text(value, _unit(placed.effect.name, parameter.name, findings))
            yield (
                f"The {parameter.name.replace('_', ' ')} of {noun} reached the limit of its allowed range ({text}): "
                "the fit has not found a best value."
            )
    if placed.effect.name == "stribeck_friction" and values["static"] < values["coulomb"]:
        yield "The fitted friction is smaller at rest than in motion, which is rare for real surfaces."


def _is_at_bound(value: float, parameter: Parameter) -> bool:
    """Whether a parameter is at a bound of its fit. A bound of 0 is not checked, nor one at which the effect
    vanishes."""
    edges = [edge for edge in (parameter.lower, parameter.upper) if edge != parameter.none]
    return any(np.isclose(value, edge, rtol=_BOUND_TOLERANCE, atol=0.0) for edge in edges if edge)


def _interval_doubts(effect: NamedEffect, placed_effects: Sequence[PlacedEffect]) -> Iterator[str]:
    """A sentence where the 95 % interval of an effect's main parameter contains the value without the effect."""
    placed = next((placed for placed in placed_effects if placed.effect.name == effect.effect), None)
    for parameter in placed.effect.parameters[:1] if placed is not None else ():
        estimate = effect.parameters.get(parameter.name)
        if estimate is None or estimate.ci95 is None or parameter.none is None:
            continue
        low, high = estimate.ci95
        if low <= parameter.none <= high:
            text = value_text(estimate.value, estimate.unit, estimate.ci95)
            yield (
                f"The interval of {noun_of(effect.effect)}, {text}, includes the value without the effect: the data "
                "hardly support it."
            )


def _model_doubts(improved: MechanicalModel) -> Iterator[str]:
    """Sentences on a damping or stiffness matrix with a negative eigenvalue beyond rounding."""
    for name, matrix in (("damping", improved.damping), ("stiffness", improved.stiffness)):
        lowest, largest = _ends(matrix)
        if lowest < -_EIGENVALUE_ROUNDING * max(largest, 1e-300):
            consequence = (
                "would generate energy"
                if name == "damping"
                else "would move away from its position of rest without a force"
            )
            yield f"The improved model's {name} is negative in one direction: in it, the device {consequence}."


def _ends(matrix: FloatArray) -> tuple[float, float]:
    """Lowest eigenvalue, and largest magnitude of an eigenvalue, of the symmetric part of a matrix."""
    values = np.linalg.eigvalsh((matrix + matrix.T) / 2)
    return float(values[0]), float(np.abs(values).max())


def _unit(effect: str, parameter: str, findings: Findings) -> str:
    """Unit of an effect's parameter in the given model's unit system; "1" where it is not in the vocabulary."""
    entry = EFFECTS_BY_NAME.get(effect)
    for known_parameter in entry.parameters if entry else ():
        if known_parameter.name == parameter:
            response = findings.time_series[0].units[0] if findings.time_series else RESPONSE
            return known_parameter.unit_in(findings.given.system, response)
    return "1"
