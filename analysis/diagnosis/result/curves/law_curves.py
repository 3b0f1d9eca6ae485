"""Signature curve of a discovered law: the missing force against the variable that explains most of the law's force.

The variable is that of the largest correlation ratio (variance of bin means over variance). Where none reaches
`_MAIN_CORRELATION_RATIO`, the missing force is drawn against the law's own value, so that a correct law is a straight
line.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from analysis.diagnosis.result.curves.signature_bins import (
    compute_bin_means,
    compute_correlation_ratio,
    compute_law_bin_means,
)
from analysis.diagnosis.result.findings import Signature
from equalizer.effects.discovered_law import (
    COMMAND_PREFIX,
    DERIVATIVE_PREFIXES,
    derive_axis_letters,
    has_memory,
    set_law_values,
)
from equalizer.effects.effect import PlacedEffect
from equalizer.effects.starts.evidence import Evidence
from equalizer.laws.evaluate import evaluate
from equalizer.laws.law import Law
from equalizer.signals.signal import FloatArray
from equalizer.signals.unit_system import UnitSystem

_EXTRAPOLATED_SHARE = 0.25
"""Share of the measured range of a variable by which a formula is drawn beyond it, on either side. Chosen by hand."""
_MAIN_CORRELATION_RATIO = 0.5
"""Correlation ratio of a law's force with one variable from which the curve is drawn against it alone.
Chosen by hand."""
_LINE_POINTS = 400
"""Number of points of a drawn law. Chosen by hand."""


@dataclass(frozen=True, slots=True, eq=False)
class _Variable:
    """A signal that a law may depend on."""

    name: str
    """Label of the abscissa with unit, such as "velocity of x (m/s)"."""
    values: FloatArray
    """(n,)"""


def compute_law_signature(
    evidence: Evidence, placed_effect: PlacedEffect, axes: tuple[str, ...], unit_system: UnitSystem
) -> Signature | None:
    """Compute the curve of a discovered law along the measured motion; for a law of the command, of the change of the
    command. None where the effect is no discovered law, or its law acts on a response, depends on no variable, or
    depends on a signal other than time, motions and commands. axes: names of the axes."""
    if placed_effect.effect.law is None or placed_effect.effect.law.acts_on == "response":
        return None
    law = set_law_values(placed_effect.effect.law, placed_effect.values)
    if law.acts_on == "command":
        command = COMMAND_PREFIX + derive_axis_letters(axes)[placed_effect.sites[0]]
        law = replace(law, expression=f"({law.expression}) - {command}", acts_on="force", units=())
    variables = _list_variables(evidence, axes, unit_system)
    if not law.variables or not set(law.variables) <= variables.keys():
        return None
    rate_hz, axis = evidence.sample_rate_hz, placed_effect.sites[0]
    force = evaluate(law, {name: variables[name].values for name in law.variables}, rate_hz)
    is_used = (evidence.used > 0) & np.isfinite(force)
    correlation_ratios = {
        name: compute_correlation_ratio(variables[name].values[is_used], force[is_used]) for name in law.variables
    }
    variable = variables[max(correlation_ratios, key=lambda name: correlation_ratios[name])]
    visited_range = None
    if max(correlation_ratios.values()) < _MAIN_CORRELATION_RATIO:  # only the variables together explain most of it
        variable = _Variable(f"force of the law ({unit_system.force})", force)
        law_abscissa, law_force = _make_identity_line(force[is_used])
    elif len(law.variables) == 1 and not has_memory(law):
        law_abscissa, law_force, visited_range = _evaluate_extrapolated(law, variable.values[is_used], rate_hz)
    else:
        law_abscissa, law_force = compute_law_bin_means(variable.values[is_used], force[is_used])
    bin_centres, mean, spread = compute_bin_means(variable.values, evidence.axis_force[:, axis], is_used, rate_hz)
    return Signature(
        placed_effect.effect.name,
        axes[axis],
        variable.name,
        f"missing force ({unit_system.force})",
        bin_centres,
        mean,
        spread,
        law_abscissa,
        law_force,
        visited_range,
    )


def _list_variables(evidence: Evidence, axes: tuple[str, ...], unit_system: UnitSystem) -> Mapping[str, _Variable]:
    """List signals by their names in a formula: time, then position, velocity, acceleration and command of each
    axis."""
    rate_hz, length = evidence.sample_rate_hz, unit_system.length
    variables = {"t": _Variable("time (s)", np.arange(len(evidence.command)) / rate_hz)}
    for index, (axis, letter) in enumerate(zip(axes, derive_axis_letters(axes), strict=True)):
        velocity = evidence.axis_velocity[:, index]
        motions = (evidence.axis_position[:, index], velocity, np.gradient(velocity) * rate_hz)
        kinds = (("position", length), ("velocity", f"{length}/s"), ("acceleration", f"{length}/s^2"))
        for prefix, motion, (kind, unit) in zip(DERIVATIVE_PREFIXES, motions, kinds, strict=True):
            variables[prefix + letter] = _Variable(f"{kind} of {axis} ({unit})", np.asarray(motion))
        variables[COMMAND_PREFIX + letter] = _Variable(
            f"command of {axis} ({unit_system.force})", evidence.command[:, index]
        )
    return variables


def _evaluate_extrapolated(
    law: Law, visited_values: FloatArray, rate_hz: float
) -> tuple[FloatArray, FloatArray, tuple[float, float]]:
    """Evaluate a formula of one variable over the range of its measured values (n,) and `_EXTRAPOLATED_SHARE` of it on
    either side. Returns abscissa, force where it is finite, and the measured range."""
    low, high = float(visited_values.min()), float(visited_values.max())
    margin = _EXTRAPOLATED_SHARE * (high - low)
    abscissa = np.linspace(low - margin, high + margin, _LINE_POINTS)
    law_force = evaluate(law, {law.variables[0]: abscissa}, rate_hz)
    is_finite = np.isfinite(law_force)
    return abscissa[is_finite], law_force[is_finite], (low, high)


def _make_identity_line(law_force: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Make abscissa and ordinate (2,) of the straight line y = x over the range of the law's force (n,)."""
    range_ends = np.array([law_force.min(), law_force.max()])
    return range_ends, range_ends
