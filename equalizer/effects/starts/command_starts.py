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
CLOSE = 3e-3
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

    def left(value: float) -> float:
        total = 0.0
        for axis, (force, basis) in zip(axes, forces, strict=True):
            commanded = evidence.command[:, axis]
            added = change(commanded, step_s, value) - commanded
            total += min(_misfit(force - np.roll(added, shift)[used], basis) for shift in SHIFTS)
        return total

    if not len(grid):
        return None
    best, misfit = best_on_grid(left, grid)
    return best if misfit < (1 - LEAST_SHARE) * sum(_misfit(force, basis) for force, basis in forces) else None


def fit_square_law(evidence: Evidence, site: int) -> tuple[float, float] | None:
    """(square, reference in N) of `square_law_force` by regression of the missing force on u and u |u|; None where the
    quadratic term explains too little. Coefficients are averaged over the axes of the site."""
    axes = range(evidence.command.shape[1]) if site == ALL_SITES else (site,)
    used, linear, squared, gained = np.flatnonzero(evidence.used > 0), [], [], 0.0
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
        none, left = (float(np.sum((force - rows[:, : len(part)] @ part) ** 2)) for part in (gain, weights))
        gained += (none - left) / max(none, 1e-300) / len(axes)
    first, second = float(np.mean(linear)), float(np.mean(squared))
    peak = float(np.abs(evidence.command[:, list(axes)]).max(initial=0.0))
    whole = first + second * peak
    if gained < LEAST_SHARE or whole <= 0:
        return None
    # Force and command agree at the reference. If that lies outside the range of commands, the gain is wrong as well;
    # the peak command is then the reference.
    agrees = (1 - first) / second if second else 0.0
    share, reference = (1 - first, agrees) if 0 < agrees < 10 * peak else (second * peak / whole, peak)
    return (share, reference) if share and -1 <= share <= 1 else None


def best_on_grid(misfit: Callable[[float], float], grid: Sequence[float]) -> tuple[float, float]:
    """The best value of a grid (ascending, > 0), refined between its neighbours, and its misfit."""
    values = [misfit(value) for value in grid]
    best = int(np.argmin(values))
    low, high = grid[max(best - 1, 0)], grid[min(best + 1, len(grid) - 1)]
    finer = _golden_section(misfit, float(np.log(low)), float(np.log(high)))
    return finer if finer[1] < values[best] else (grid[best], values[best])


def _golden_section(misfit: Callable[[float], float], low: float, high: float) -> tuple[float, float]:
    """Minimum between two values, given by their logarithms, and its misfit: golden-section search (Kiefer 1953, Proc.
    AMS 4:502)."""
    places = [high - GOLDEN * (high - low), low + GOLDEN * (high - low)]
    values = [misfit(float(np.exp(place))) for place in places]
    while high - low > 2 * CLOSE:
        if values[0] <= values[1]:
            high, added = places[1], places[1] - GOLDEN * (places[1] - low)
            places, values = [added, places[0]], [misfit(float(np.exp(added))), values[0]]
        else:
            low, added = places[0], places[0] + GOLDEN * (high - places[0])
            places, values = [places[1], added], [values[1], misfit(float(np.exp(added)))]
    best = int(np.argmin(values))
    return float(np.exp(places[best])), values[best]


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


def _misfit(rest: FloatArray, basis: FloatArray) -> float:
    """Sum of squares of `rest` (k,) after projection on an orthonormal basis (k, columns)."""
    along = basis.T @ rest
    return float(rest @ rest - along @ along)
