"""Starting values of actuator effects, from the missing force at a driven axis.

An effect changes the command u to the force f(u, p). The parameter p is sought for which f(u, p) - u leaves the least
of the missing force, in the sense of least squares; terms that a re-tuned linear model may have absorbed are projected
out. Search: grid, then golden section on the logarithm of p.
"""

from collections.abc import Callable, Sequence

import numpy as np

from equalizer.effects.effect import ALL_SITES
from equalizer.effects.starts.evidence import Evidence
from equalizer.signals.signal import FloatArray

LEAST_SHARE = 1e-3
"""Least share of the missing force's sum of squares that a value must explain to become a starting value."""
SHIFTS = (0, 1)
"""Delays of the effect's force that are tried, in samples."""
LOG_TOLERANCE = 3e-3
"""Relative tolerance of the parameter in the golden-section search."""
GOLDEN = (5**0.5 - 1) / 2
"""Golden ratio less 1: the share by which golden-section search shrinks its interval."""


def likeliest_value(
    evidence: Evidence,
    site: int,
    change: Callable[[FloatArray, float, float], FloatArray],
    grid: Sequence[float],
    nonlinear: bool,
) -> float | None:
    """The parameter value whose changed command leaves the least missing force, by grid search refined by golden
    section; None where no value explains the share `LEAST_SHARE`. site: axis, or ALL_SITES for one value at all axes.

    change: maps samples (n,), their period in s and a value to changed samples. grid: ascending, > 0. nonlinear:
    whether to project out position, velocity and acceleration, whose coefficients re-tuning may have absorbed.
    """
    axes = range(evidence.command.shape[1]) if site == ALL_SITES else (site,)
    step_s = 1 / evidence.sample_rate_hz
    forces = [_force_and_basis(evidence, axis, nonlinear) for axis in axes]
    used = np.flatnonzero(evidence.used > 0)

    def remaining_misfit(value: float) -> float:
        total = 0.0
        for axis, (force, basis) in zip(axes, forces, strict=True):
            commanded = evidence.command[:, axis]
            change_of_force = change(commanded, step_s, value) - commanded
            total += min(_misfit(force - np.roll(change_of_force, shift)[used], basis) for shift in SHIFTS)
        return total

    if not len(grid):
        return None
    best, misfit = best_on_grid(remaining_misfit, grid)
    return best if misfit < (1 - LEAST_SHARE) * sum(_misfit(force, basis) for force, basis in forces) else None


def fit_square_law(evidence: Evidence, site: int) -> tuple[float, float] | None:
    """(square, reference in N) of `square_law_force` by regression of the missing force on u and u |u|; None where the
    quadratic term explains too little. Coefficients are averaged over the axes of the site."""
    axes = range(evidence.command.shape[1]) if site == ALL_SITES else (site,)
    used, linear, squared, explained_share = np.flatnonzero(evidence.used > 0), [], [], 0.0
    for axis in axes:
        force, basis = _force_and_basis(evidence, axis, True)
        u = evidence.command[used, axis]
        rows = np.column_stack([u, u * np.abs(u)])
        rows -= basis @ (basis.T @ rows)
        force = force - basis @ (basis.T @ force)
        gain, weights = (np.linalg.lstsq(rows[:, :k], force, rcond=None)[0] for k in (1, 2))
        linear.append(1 + float(weights[0]))
        squared.append(float(weights[1]))
        # Sums of squares without and with the quadratic term.
        linear_misfit, square_misfit = (
            float(np.sum((force - rows[:, : len(coefficients)] @ coefficients) ** 2))
            for coefficients in (gain, weights)
        )
        explained_share += (linear_misfit - square_misfit) / max(linear_misfit, 1e-300) / len(axes)
    first, second = float(np.mean(linear)), float(np.mean(squared))
    peak = float(np.abs(evidence.command[:, list(axes)]).max(initial=0.0))
    peak_force = first + second * peak
    if explained_share < LEAST_SHARE or peak_force <= 0:
        return None
    # Force and command agree at the reference. If that lies outside the range of commands, the gain is wrong as well;
    # the peak command is then the reference.
    equal_force = (1 - first) / second if second else 0.0
    share, reference = (1 - first, equal_force) if 0 < equal_force < 10 * peak else (second * peak / peak_force, peak)
    return (share, reference) if share and -1 <= share <= 1 else None


def best_on_grid(misfit: Callable[[float], float], grid: Sequence[float]) -> tuple[float, float]:
    """The best value of a grid (ascending, > 0), refined between its neighbours, and its misfit."""
    values = [misfit(value) for value in grid]
    best = int(np.argmin(values))
    low, high = grid[max(best - 1, 0)], grid[min(best + 1, len(grid) - 1)]
    refined = _golden_section(misfit, float(np.log(low)), float(np.log(high)))
    return refined if refined[1] < values[best] else (grid[best], values[best])


def _golden_section(misfit: Callable[[float], float], low: float, high: float) -> tuple[float, float]:
    """Minimum between two values, given by their logarithms, and its misfit: golden-section search (Kiefer 1953, Proc.
    AMS 4:502)."""
    points = [high - GOLDEN * (high - low), low + GOLDEN * (high - low)]
    values = [misfit(float(np.exp(point))) for point in points]
    while high - low > 2 * LOG_TOLERANCE:
        if values[0] <= values[1]:
            high, new_point = points[1], points[1] - GOLDEN * (points[1] - low)
            points, values = [new_point, points[0]], [misfit(float(np.exp(new_point))), values[0]]
        else:
            low, new_point = points[0], points[0] + GOLDEN * (high - points[0])
            points, values = [points[1], new_point], [values[1], misfit(float(np.exp(new_point)))]
    best = int(np.argmin(values))
    return float(np.exp(points[best])), values[best]


def grid_of_peaks(evidence: Evidence, site: int, count: int = 12) -> list[float]:
    """Force levels (N) to try, from 3 % to 99.5 % of the strongest command; empty without a command."""
    commanded = evidence.command if site == ALL_SITES else evidence.command[:, site]
    peak = float(np.abs(commanded).max())
    return list(np.geomspace(0.03 * peak, 0.995 * peak, count)) if peak > 0 else []


def _force_and_basis(evidence: Evidence, axis: int, nonlinear: bool) -> tuple[FloatArray, FloatArray]:
    """The missing force (k,) where samples count, and an orthonormal basis (k, columns) of position, velocity and
    acceleration; without columns unless nonlinear."""
    used, v = evidence.used > 0, evidence.axis_velocity[:, axis]
    force = evidence.axis_force[used, axis]
    if not nonlinear:
        return force, np.zeros((len(force), 0))
    motion = np.column_stack([evidence.axis_position[:, axis], v, np.gradient(v)])[used]
    return force, np.linalg.qr(motion / np.maximum(np.linalg.norm(motion, axis=0), np.finfo(float).tiny))[0]


def _misfit(force: FloatArray, basis: FloatArray) -> float:
    """Sum of squares of `force` (k,) after projection on an orthonormal basis (k, columns)."""
    projection = basis.T @ force
    return float(force @ force - projection @ projection)
