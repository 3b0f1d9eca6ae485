"""Drift of a device during a session: probes are compared line by line with the first ones, in physical parameters.

A line drives one axis j with the force F; all axes answer with accelerations A. With A0, F0 of the first probes at the
same level, and a mechanism that is reciprocal, its other properties cancel in

    (F A0_j - F0 A_j) / (A0_j A_j) = sum over k of (dM_k + dC_k / iw - dK_k / w^2) A0_k A_k / (A0_j A_j)
                                     - g_j F / A_j + iw T F / A_j + friction

dM, dC, dK: change of the hand's mass, damping and stiffness; g: relative change of the delivered force; T: added delay.
Friction: its shapes S (force of 1 N along the measured motion) times its change, dFc_k A0_k S_k / (A0_j A_j), and times
its initial value, because the shape changes with the motion. That value is estimated from the level dependence of the
first responses. The noise is estimated from the differences between the first probes of a level. Of all causes and
pairs of causes, those with the best penalised fit are selected. Called by `session_drift`.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np
import numpy.typing as npt

from analysis.device_change.probe_lines import ProbeLines, compute_friction_spectra
from equalizer.signals.signal import ComplexArray, FloatArray

IntArray = npt.NDArray[np.int64]

AXES = "xyz"
BASE_CYCLES = 2
"""Number of probes at each level before anything is compared: their differences give the noise."""
PENALTY_PER_PARAMETER = 8.0
"""Penalty per parameter, in units of the squared misfit over noise: more than twice Akaike's, against false alarms."""
MOST_CAUSES = 2
"""Largest number of causes at a time: more of them would also fit the deviations of real friction from its law."""
RIVAL_RATIO = 2.0
"""Ratio of squared misfits below which two causes cannot be distinguished. On the simulated omega.3, whose friction
deviates from the law, the ratio of grip to gain is 1.2 to 1.7 when the hand's impedance grows by half."""
DELAY_STEPS = 3
"""Gauss-Newton steps for the delay, of which the response is a nonlinear function."""
DEVIATIONS = 4.0
"""Standard errors beyond which a change is significant."""

CAUSES = {"friction": ("friction",), "grip": ("mass", "damping", "stiffness"), "gain": ("gain",), "delay": ("delay",)}
NUMBERS = ("friction", "mass", "damping", "stiffness", "gain", "delay")
UNITS = {"friction": "N", "mass": "kg", "damping": "N s/m", "stiffness": "N/m", "gain": "", "delay": "s"}
SMALLEST_CHANGE = {"friction": 0.03, "mass": 0.01, "damping": 0.5, "stiffness": 15.0, "gain": 0.03, "delay": 3e-4}
"""Least reported changes: 3 % of a stimulus of 1 N, or a tenth of a light grip."""


@dataclass(frozen=True, slots=True, eq=False)
class TimedProbe:
    """One probe with a hand on the handle."""

    time_s: float
    """Time since the session began."""
    level_n: float
    lines: ProbeLines


@dataclass(frozen=True, slots=True)
class Drift:
    """One number that changed, at the time of the newest probe that was compared."""

    cause: str
    """friction, grip, gain or delay"""
    number: str
    """friction, mass, damping, stiffness, gain or delay"""
    axis: str
    time_s: float
    change: float
    error: float
    """Standard error."""
    initial_value: float | None
    """Initial value of the friction; None where only the change is known."""
    rivals: tuple[str, ...] = ()
    """Causes that the probes cannot tell from this one."""

    @property
    def unit(self) -> str:
        """Unit of `change`, `error` and `before`; empty for a gain, whose change is relative."""
        return UNITS[self.number]


def find_drifts(probes: Sequence[TimedProbe], period: int, causes: Sequence[str] = tuple(CAUSES)) -> tuple[Drift, ...]:
    """Differences of the newest probe of each level from the first ones. Empty with too few probes. period: samples.
    Probes are ordered by time. causes: possible changes; without a hand no grip."""
    levels = sorted({probe.level_n for probe in probes})
    by_level = {level: [probe for probe in probes if probe.level_n == level] for level in levels}
    if not probes or min(len(level_probes) for level_probes in by_level.values()) < BASE_CYCLES + 1:
        return ()
    first_probes = [probe for level_probes in by_level.values() for probe in level_probes[:BASE_CYCLES]]
    newest = [level_probes[-1] for level_probes in by_level.values()]
    compared_probes = [*first_probes, *newest]
    shapes = compute_friction_spectra(tuple(probe.lines for probe in compared_probes), period)
    probe_levels, newest_s = (
        np.array([probe.level_n for probe in compared_probes]),
        max(probe.time_s for probe in newest),
    )
    delay_s = 0.0
    for _ in range(DELAY_STEPS):  # a delay turns phases; its column is that for a small one
        compared = _compare_probes(compared_probes, shapes, probe_levels, delay_s)
        changes = tuple(_select_causes(compared, newest_s, tuple(causes)))
        delay_s += sum(drift.change for drift in changes if drift.number == "delay")
    delay = replace(_estimate_delay(compared, newest_s), change=delay_s)
    other_drifts = tuple(drift for drift in changes if drift.number != "delay")
    return (
        (*other_drifts, delay)
        if abs(delay_s) > max(SMALLEST_CHANGE["delay"], DEVIATIONS * delay.error)
        else other_drifts
    )


def _estimate_delay(compared: _Comparison, time_s: float) -> Drift:
    """A delay as the only cause, with its standard error; its `change` is 0."""
    error = float(_fit(compared, ("delay",))[2][0])
    return Drift("delay", "delay", "", time_s, 0.0, error, None)


@dataclass(frozen=True, slots=True, eq=False)
class _Comparison:
    """Regression of the difference on the causes, in units of the noise."""

    difference: ComplexArray
    """(equations,): left side of the module's equation, one per line of each newest probe."""
    columns: dict[tuple[str, int], ComplexArray]
    """(equations,) by parameter and axis: its change per unit of the parameter."""
    friction_n: FloatArray
    """(axes,): friction at the first probes."""


def _compare_probes(
    probes: Sequence[TimedProbe], shapes: ComplexArray, levels: FloatArray, delay_s: float
) -> _Comparison:
    lines, axes = np.nonzero(probes[0].lines.driven)
    w = 2 * np.pi * probes[0].lines.frequency_hz[lines]
    acceleration = np.array([probe.lines.acceleration_mps2[lines] for probe in probes])
    force = np.array([probe.lines.force_n[lines, axes] for probe in probes])
    driven_acceleration = np.take_along_axis(acceleration, axes[None, :, None], axis=2)[..., 0]
    first_count = BASE_CYCLES * len(set(levels.tolist()))
    force[first_count:] *= np.exp(-1j * w * delay_s)
    friction_n, shape = _estimate_first_friction(
        force / driven_acceleration, shapes[:, :, lines], (driven_acceleration, axes), first_count
    )
    first_indices = {level: np.flatnonzero(levels[:first_count] == level) for level in set(levels.tolist())}

    def mean_of_first(values: ComplexArray, requested_levels: FloatArray) -> ComplexArray:
        """Mean over the first probes of each requested level; linear in responses to the same force."""
        return np.array([values[first_indices[level]].mean(axis=0) for level in requested_levels])

    newest = slice(first_count, None)
    first_acceleration, first_driven, first_force, first_shape = (
        mean_of_first(spectrum, levels[newest]) for spectrum in (acceleration, driven_acceleration, force, shape)
    )
    product = first_driven * driven_acceleration[newest]
    scatter = driven_acceleration[:first_count] - mean_of_first(driven_acceleration, levels[:first_count])
    noise = float(np.sqrt(np.mean(np.abs(scatter) ** 2) * BASE_CYCLES / (BASE_CYCLES - 1) * (1 + 1 / BASE_CYCLES)))
    scale = np.abs(first_force) / np.abs(product) * noise
    known_friction = ((first_acceleration * shape[newest] - acceleration[newest] * first_shape) * friction_n).sum(
        axis=2
    )
    difference = (force[newest] * first_driven - first_force * driven_acceleration[newest] - known_friction) / product
    columns = _make_columns(
        w,
        force[newest] / driven_acceleration[newest],
        axes,
        (first_acceleration * acceleration[newest], first_acceleration * shape[newest], product),
    )
    return _Comparison(
        (difference / scale).ravel(), {name: (column / scale).ravel() for name, column in columns.items()}, friction_n
    )


def _make_columns(
    w: FloatArray,
    apparent_mass: ComplexArray,
    axes: IntArray,
    products: tuple[ComplexArray, ComplexArray, ComplexArray],
) -> dict[tuple[str, int], ComplexArray]:
    """Change of the difference per unit of each parameter, (probes, lines), by parameter and axis. The delay is common
    to all axes and stored as axis 0."""
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
    """Friction (N) along each axis at the first probes, and its shapes, (probes, lines, axes), with the break-away that
    fits best: the level-dependent part of the apparent mass is fitted, its mean over the levels is subtracted."""
    driven_acceleration, axes = driven
    apparent_mass = apparent_mass[:count]
    best = (np.inf, np.zeros(3), shapes[0])
    for shape in shapes:
        driven_shape = (
            np.take_along_axis(shape, axes[None, :, None], axis=2)[..., 0][:count] / driven_acceleration[:count]
        )
        misfit, levels_n = 0.0, np.zeros(3)
        for axis in range(3):
            is_axis = axes == axis
            weight = 1 / np.abs(apparent_mass[:, is_axis])
            x = _stack_real_imaginary((driven_shape - driven_shape.mean(axis=0))[:, is_axis] * weight)
            y = _stack_real_imaginary((apparent_mass - apparent_mass.mean(axis=0))[:, is_axis] * weight)
            levels_n[axis] = max(0.0, float(x @ y / max(float(x @ x), 1e-300)))
            misfit += float(np.sum((y - levels_n[axis] * x) ** 2))
        if misfit < best[0]:
            best = (misfit, levels_n, shape)
    return best[1], best[2]


def _select_causes(compared: _Comparison, time_s: float, causes: tuple[str, ...]) -> Iterator[Drift]:
    """The significant changes of the parameters of the best set of causes."""
    count = 2 * len(compared.difference)
    # The misfit that all causes together leave beyond the noise raises every standard error.
    inflation = max(1.0, _fit(compared, causes)[0] / max(1, count - len(_list_parameters(causes))))
    misfit = {
        cause_set: _fit(compared, cause_set)[0]
        for size in range(MOST_CAUSES + 1)
        for cause_set in combinations(causes, size)
    }

    def cost(cause_set: tuple[str, ...]) -> float:
        # Squared misfit while that is at the noise level, else its logarithm, as of a noise of unknown variance.
        scaled_misfit = misfit[cause_set] / inflation
        return PENALTY_PER_PARAMETER * len(_list_parameters(cause_set)) + (
            count * float(np.log(scaled_misfit / count)) if scaled_misfit > count else scaled_misfit - count
        )

    best = min(misfit, key=cost)
    _, values, errors = _fit(compared, best)
    for (number, axis), value, error in zip(_list_parameters(best), values, errors, strict=True):
        inflated_error = float(error * np.sqrt(inflation))
        if abs(value) > max(SMALLEST_CHANGE[number], DEVIATIONS * inflated_error):
            cause = next(cause for cause, numbers in CAUSES.items() if number in numbers)
            initial_n = float(compared.friction_n[axis]) if number == "friction" else None
            axis_name = "" if cause == "delay" else AXES[axis]
            yield Drift(
                cause,
                number,
                axis_name,
                time_s,
                float(value),
                inflated_error,
                initial_n,
                _find_rivals(cause, best, misfit),
            )


def _find_rivals(cause: str, best: tuple[str, ...], misfit: dict[tuple[str, ...], float]) -> tuple[str, ...]:
    """Causes that, in place of this one, leave less than `RIVAL_RATIO` times its squared misfit."""
    alternatives = {
        candidate: tuple(
            kept_cause
            for kept_cause in CAUSES
            if (kept_cause in best and kept_cause != cause) or kept_cause == candidate
        )
        for candidate in CAUSES
        if candidate not in best
    }
    return tuple(
        candidate
        for candidate, cause_set in alternatives.items()
        if misfit.get(cause_set, np.inf) < RIVAL_RATIO * misfit[best]
    )


def _fit(compared: _Comparison, causes: tuple[str, ...]) -> tuple[float, FloatArray, FloatArray]:
    """Squared misfit over noise, the fitted parameters, and their standard errors."""
    y = _stack_real_imaginary(compared.difference) * np.sqrt(2)  # each part has half of the noise's power
    names = _list_parameters(causes)
    if not names:
        return float(y @ y), np.empty(0), np.empty(0)
    x = np.stack([_stack_real_imaginary(compared.columns[name]) for name in names], axis=1) * np.sqrt(2)
    size = np.linalg.norm(x, axis=0)
    inverse = np.linalg.pinv((x / size).T @ (x / size)) / np.outer(size, size)
    values = inverse @ x.T @ y
    return float(np.sum((y - x @ values) ** 2)), values, np.sqrt(np.diag(inverse))


def _list_parameters(causes: tuple[str, ...]) -> tuple[tuple[str, int], ...]:
    """Parameters of these causes with their axes; a delay is common to all axes."""
    numbers = [number for cause in causes for number in CAUSES[cause]]
    return tuple((number, axis) for number in numbers for axis in range(1 if number == "delay" else 3))


def _stack_real_imaginary(values: ComplexArray) -> FloatArray:
    flat = values.ravel()
    return np.concatenate([flat.real, flat.imag])
