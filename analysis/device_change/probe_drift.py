"""Drift of a device during a session: probes are compared line by line with the first ones, in physical parameters.

A spectral line drives one axis j with the force F; all axes respond with accelerations A. With A0, F0 of the first
probes at the same level, and a reciprocal mechanism, its other properties cancel in

    (F A0_j - F0 A_j) / (A0_j A_j) = sum over k of (dM_k + dC_k / iw - dK_k / w^2) A0_k A_k / (A0_j A_j)
                                     - g_j F / A_j + iw T F / A_j + friction

dM, dC, dK: change of the hand's mass, damping and stiffness; g: relative change of the delivered force; T: added delay.
Friction: its shapes S (force of 1 N along the measured motion) times its change, dFc_k A0_k S_k / (A0_j A_j), and times
its initial value, because the shape changes with the motion. That value is estimated from the level dependence of the
first responses. The noise is estimated from the differences between the first probes of a level. Of no cause, single
causes and pairs, those with the best penalised fit are selected. Begin at `find_drifts`."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np
import numpy.typing as npt

from analysis.device_change.probe_lines import ProbeLines, compute_friction_spectra
from equalizer.signals.signal import ComplexArray, FloatArray

IntArray = npt.NDArray[np.int64]

AXES = "xyz"  # names of the axes, by index
FIRST_PROBES = 2
"""Number of reference probes at each level; their differences give the noise."""
PENALTY_PER_PARAMETER = 8.0
"""Penalty per parameter, in units of the squared misfit over noise: four times Akaike's, against false alarms."""
MAX_CAUSES = 2
"""Largest number of causes at a time: more of them would also fit the deviations of real friction from its law."""
RIVAL_RATIO = 2.0
"""Ratio of squared misfits below which two causes cannot be distinguished. On the simulated omega.3, whose friction
deviates from the law, the ratio of grip to gain is 1.2 to 1.7 when the hand's impedance grows by half."""
DELAY_ITERATIONS = 3
"""Gauss-Newton steps for the delay, of which the response is a nonlinear function."""
LEAST_NOISE_SHARE = 1e-9
"""Smallest noise, relative to the strongest acceleration: first probes without any difference, as of a replayed
recording, have none to divide by. Chosen, far below the noise of a sensor."""
Z_LIMIT = 4.0
"""Standard errors beyond which a change is significant; chosen by hand, against false alarms."""

CAUSES = {"friction": ("friction",), "grip": ("mass", "damping", "stiffness"), "gain": ("gain",), "delay": ("delay",)}
PARAMETER_UNITS = {"friction": "N", "mass": "kg", "damping": "N s/m", "stiffness": "N/m", "gain": "", "delay": "s"}
LEAST_CHANGE = {"friction": 0.03, "mass": 0.01, "damping": 0.5, "stiffness": 15.0, "gain": 0.03, "delay": 3e-4}
"""Least reported changes, in `PARAMETER_UNITS`: 3 % of a stimulus of 1 N or of the gain, a tenth of a light grip."""


@dataclass(frozen=True, slots=True, eq=False)
class TimedProbe:
    """One probe of a session, with or without a hand on the handle."""

    time_s: float
    """Time since the session began."""
    level_n: float  # amplitude of the excitation, N
    lines: ProbeLines


@dataclass(frozen=True, slots=True)
class Drift:
    """A parameter that changed, at the time of the newest probe that was compared."""

    cause: str
    """friction, grip, gain or delay"""
    parameter: str
    """friction, mass, damping, stiffness, gain or delay"""
    axis: str  # x, y or z; empty for a delay
    time_s: float  # of that probe, since the session began
    change: float  # since the first probes, in `unit`
    error: float  # standard error of the change
    initial_value: float | None
    """Initial value of the friction (N); None for other parameters, of which only the change is known."""
    rivals: tuple[str, ...] = ()
    """Causes that the probes cannot tell from this one; not sought for a delay."""

    @property
    def unit(self) -> str:
        """Unit of `change`, `error` and `initial_value`; empty for a gain, whose change is relative."""
        return PARAMETER_UNITS[self.parameter]


def find_drifts(probes: Sequence[TimedProbe], period: int, causes: Sequence[str] = tuple(CAUSES)) -> tuple[Drift, ...]:
    """Find the significant changes from the first probes of each level to its newest one. Empty without probes, or
    where a level has none after its `FIRST_PROBES`. probes: by rising time. period: in samples. causes: of `CAUSES`; no
    grip without a hand."""
    levels_n = sorted({probe.level_n for probe in probes})
    probes_by_level = {level_n: [probe for probe in probes if probe.level_n == level_n] for level_n in levels_n}
    if not probes or min(len(level_probes) for level_probes in probes_by_level.values()) < FIRST_PROBES + 1:
        return ()
    first_probes = [probe for level_probes in probes_by_level.values() for probe in level_probes[:FIRST_PROBES]]
    newest_probes = [level_probes[-1] for level_probes in probes_by_level.values()]
    compared_probes = [*first_probes, *newest_probes]
    shapes = compute_friction_spectra(tuple(probe.lines for probe in compared_probes), period)
    newest_s = max(probe.time_s for probe in newest_probes)
    probe_levels_n = np.array([probe.level_n for probe in compared_probes])
    delay_s = 0.0
    for _ in range(DELAY_ITERATIONS):  # a delay turns phases; its column is that for a small one
        comparison = _compare_probes(compared_probes, shapes, probe_levels_n, delay_s)
        drifts = tuple(_select_causes(comparison, newest_s, tuple(causes)))
        delay_s += sum(drift.change for drift in drifts if drift.parameter == "delay")
    delay = replace(_make_delay_drift(comparison, newest_s, tuple(causes)), change=delay_s)
    other_drifts = tuple(drift for drift in drifts if drift.parameter != "delay")
    return (*other_drifts, delay) if abs(delay_s) > max(LEAST_CHANGE["delay"], Z_LIMIT * delay.error) else other_drifts


def _make_delay_drift(comparison: _Comparison, time_s: float, causes: tuple[str, ...]) -> Drift:
    """Make the drift of a delay, with the standard error that the delay has as the only cause; its `change` is 0."""
    error_s = _fit_causes(comparison, ("delay",))[2][0] * np.sqrt(_compute_inflation(comparison, causes))
    return Drift("delay", "delay", "", time_s, 0.0, float(error_s), None)


@dataclass(frozen=True, slots=True, eq=False)
class _Comparison:
    """Regression of the difference on the causes; both sides are divided by the noise."""

    difference: ComplexArray
    """(equations,): left side of the module's equation less known friction; per driven line and newest probe."""
    columns: dict[tuple[str, int], ComplexArray]
    """(equations,) by parameter and axis: its change per unit of the parameter."""
    friction_n: FloatArray
    """(axes,): friction at the first probes."""


def _compare_probes(
    probes: Sequence[TimedProbe], shapes: ComplexArray, levels_n: FloatArray, delay_s: float
) -> _Comparison:
    """Build the regression. probes: the first ones of all levels, then the newest one of each. shapes: of friction, by
    `compute_friction_spectra`. delay_s: added delay of the newest probes that was found before and is removed."""
    line_indices, axes = np.nonzero(probes[0].lines.driven)
    w = 2 * np.pi * probes[0].lines.frequency_hz[line_indices]
    acceleration = np.array([probe.lines.acceleration_mps2[line_indices] for probe in probes])
    force = np.array([probe.lines.force_n[line_indices, axes] for probe in probes])
    driven_acceleration = np.take_along_axis(acceleration, axes[None, :, None], axis=2)[..., 0]
    first_count = FIRST_PROBES * len(set(levels_n.tolist()))
    force[first_count:] *= np.exp(-1j * w * delay_s)
    friction_n, shape = _estimate_first_friction(
        force / driven_acceleration, shapes[:, :, line_indices], (driven_acceleration, axes), first_count
    )
    first_indices = {level: np.flatnonzero(levels_n[:first_count] == level) for level in set(levels_n.tolist())}

    def average_first(values: ComplexArray, requested_levels_n: FloatArray) -> ComplexArray:
        """Average the first probes of each requested level: responses to the same force."""
        return np.array([values[first_indices[level]].mean(axis=0) for level in requested_levels_n])

    newest = slice(first_count, None)
    first_acceleration, first_driven, first_force, first_shape = (
        average_first(spectrum, levels_n[newest]) for spectrum in (acceleration, driven_acceleration, force, shape)
    )
    product = first_driven * driven_acceleration[newest]
    scatter = driven_acceleration[:first_count] - average_first(driven_acceleration, levels_n[:first_count])
    noise = np.sqrt(np.mean(np.abs(scatter) ** 2) * FIRST_PROBES / (FIRST_PROBES - 1) * (1 + 1 / FIRST_PROBES))
    least_noise = LEAST_NOISE_SHARE * np.abs(driven_acceleration).max()
    scale = np.abs(first_force) / np.abs(product) * max(noise, least_noise)
    shape_difference = first_acceleration * shape[newest] - acceleration[newest] * first_shape
    known_friction = (shape_difference * friction_n).sum(axis=2)
    difference = (force[newest] * first_driven - first_force * driven_acceleration[newest] - known_friction) / product
    columns = _compute_columns(
        w,
        force[newest] / driven_acceleration[newest],
        axes,
        (first_acceleration * acceleration[newest], first_acceleration * shape[newest], product),
    )
    return _Comparison(
        (difference / scale).ravel(), {name: (column / scale).ravel() for name, column in columns.items()}, friction_n
    )


def _compute_columns(
    w: FloatArray,
    apparent_mass: ComplexArray,
    axes: IntArray,
    products: tuple[ComplexArray, ComplexArray, ComplexArray],
) -> dict[tuple[str, int], ComplexArray]:
    """Compute the difference per unit of each parameter, (probes, lines), by parameter and axis; of the delay, common
    to all axes, as axis 0. products: numerators for motion and friction, denominator A0_j A_j."""
    motion_product, friction_product, product = products
    columns: dict[tuple[str, int], ComplexArray] = {("delay", 0): 1j * w * apparent_mass}
    for axis in range(3):
        motion_column = motion_product[..., axis] / product
        columns["friction", axis] = friction_product[..., axis] / product
        columns["mass", axis] = motion_column
        columns["damping", axis] = motion_column / (1j * w)
        columns["stiffness", axis] = -motion_column / w**2
        columns["gain", axis] = np.where(axes == axis, -apparent_mass, 0)
    return columns


def _estimate_first_friction(
    apparent_mass: ComplexArray, shapes: ComplexArray, driven: tuple[ComplexArray, IntArray], count: int
) -> tuple[FloatArray, ComplexArray]:
    """Estimate the friction (N) of each axis at the `count` first probes, and its shapes (probes, lines, axes), with
    the break-away length that best fits the apparent mass less its mean over these probes."""
    driven_acceleration, axes = driven
    apparent_mass = apparent_mass[:count]
    best_fit = (np.inf, np.zeros(3), shapes[0])
    for shape in shapes:
        driven_shape = (
            np.take_along_axis(shape, axes[None, :, None], axis=2)[..., 0][:count] / driven_acceleration[:count]
        )
        misfit, axis_friction_n = 0.0, np.zeros(3)
        for axis in range(3):
            drives_axis = axes == axis
            weight = 1 / np.abs(apparent_mass[:, drives_axis])
            x = _stack_real_imaginary((driven_shape - driven_shape.mean(axis=0))[:, drives_axis] * weight)
            y = _stack_real_imaginary((apparent_mass - apparent_mass.mean(axis=0))[:, drives_axis] * weight)
            axis_friction_n[axis] = max(0.0, float(x @ y / max(float(x @ x), 1e-300)))
            misfit += float(np.sum((y - axis_friction_n[axis] * x) ** 2))
        if misfit < best_fit[0]:
            best_fit = (misfit, axis_friction_n, shape)
    return best_fit[1], best_fit[2]


def _select_causes(comparison: _Comparison, time_s: float, causes: tuple[str, ...]) -> Iterator[Drift]:
    """Select the set of at most `MAX_CAUSES` causes with the least cost, and yield its significant changes."""
    equation_count, inflation = 2 * len(comparison.difference), _compute_inflation(comparison, causes)
    misfits = {
        cause_set: _fit_causes(comparison, cause_set)[0]
        for cause_count in range(MAX_CAUSES + 1)
        for cause_set in combinations(causes, cause_count)
    }

    def compute_cost(cause_set: tuple[str, ...]) -> float:
        # Squared misfit while that is at the noise level, else its logarithm, as of a noise of unknown variance.
        scaled_misfit = misfits[cause_set] / inflation
        return PENALTY_PER_PARAMETER * len(_list_parameters(cause_set)) + (
            equation_count * float(np.log(scaled_misfit / equation_count))
            if scaled_misfit > equation_count
            else scaled_misfit - equation_count
        )

    best_causes = min(misfits, key=compute_cost)
    _, values, errors = _fit_causes(comparison, best_causes)
    for (parameter, axis), value, error in zip(_list_parameters(best_causes), values, errors, strict=True):
        inflated_error = float(error * np.sqrt(inflation))
        if abs(value) > max(LEAST_CHANGE[parameter], Z_LIMIT * inflated_error):
            cause = next(cause for cause, cause_parameters in CAUSES.items() if parameter in cause_parameters)
            initial_n = float(comparison.friction_n[axis]) if parameter == "friction" else None
            axis_name = "" if cause == "delay" else AXES[axis]
            rivals = _find_rivals(cause, best_causes, misfits)
            yield Drift(cause, parameter, axis_name, time_s, float(value), inflated_error, initial_n, rivals)


def _compute_inflation(comparison: _Comparison, causes: tuple[str, ...]) -> float:
    """Compute the factor on the variances of all estimates: reduced chi-squared of all causes together, at least 1."""
    degrees_of_freedom = max(1, 2 * len(comparison.difference) - len(_list_parameters(causes)))
    return max(1.0, _fit_causes(comparison, causes)[0] / degrees_of_freedom)


def _find_rivals(cause: str, best_causes: tuple[str, ...], misfits: dict[tuple[str, ...], float]) -> tuple[str, ...]:
    """Find the causes that, in place of this one, leave less than `RIVAL_RATIO` times its squared misfit."""
    alternatives = {
        candidate: tuple(
            kept_cause
            for kept_cause in CAUSES
            if (kept_cause in best_causes and kept_cause != cause) or kept_cause == candidate
        )
        for candidate in CAUSES
        if candidate not in best_causes
    }
    return tuple(
        candidate
        for candidate, cause_set in alternatives.items()
        if misfits.get(cause_set, np.inf) < RIVAL_RATIO * misfits[best_causes]
    )


def _fit_causes(comparison: _Comparison, causes: tuple[str, ...]) -> tuple[float, FloatArray, FloatArray]:
    """Compute the squared misfit over the noise, the fitted parameters, and their standard errors; both 0 for a
    parameter without effect, such as the gain of an axis that no line drives."""
    y = _stack_real_imaginary(comparison.difference) * np.sqrt(2)  # each part has half of the noise's power
    parameters = _list_parameters(causes)
    if not parameters:
        return float(y @ y), np.empty(0), np.empty(0)
    x = np.sqrt(2) * np.stack([_stack_real_imaginary(comparison.columns[name]) for name in parameters], axis=1)
    column_norms = np.maximum(np.linalg.norm(x, axis=0), np.finfo(float).tiny ** 0.25)
    inverse = np.linalg.pinv((x / column_norms).T @ (x / column_norms)) / np.outer(column_norms, column_norms)
    values = inverse @ x.T @ y
    return float(np.sum((y - x @ values) ** 2)), values, np.sqrt(np.diag(inverse))


def _list_parameters(causes: tuple[str, ...]) -> tuple[tuple[str, int], ...]:
    """List the parameters of these causes with their axes; a delay, common to all axes, with axis 0."""
    parameters = [parameter for cause in causes for parameter in CAUSES[cause]]
    return tuple((parameter, axis) for parameter in parameters for axis in range(1 if parameter == "delay" else 3))


def _stack_real_imaginary(values: ComplexArray) -> FloatArray:
    """Stack (2 n,): real parts of n values of any shape, then their imaginary parts."""
    flattened = values.ravel()
    return np.concatenate([flattened.real, flattened.imag])
