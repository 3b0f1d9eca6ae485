"""Starting values of what changes a command, from the force that the model lacks at a driven axis."""

from collections.abc import Callable, Sequence

import numpy as np
from scipy.optimize import minimize_scalar

from equalizer.effects.effect import ALL_SITES
from equalizer.effects.starts.evidence import Evidence
from equalizer.signals.signal import FloatArray

LEAST_SHARE = 1e-3
"""Of the missing force, that a value must explain to be worth a try."""
SHIFTS = (0, 1)
"""Samples by which the force may come after its command."""
CLOSE, TRIES = 3e-3, 10
"""A refinement is closer than this, relative, or ends after so many tries."""


def likeliest_value(
    evidence: Evidence,
    site: int,
    change: Callable[[FloatArray, float, float], FloatArray],
    grid: Sequence[float],
    nonlinear: bool,
) -> float | None:
    """The value, near one of the grid's (rising, above zero), whose changed command leaves the least missing force.

    change: samples (n,), seconds between them, value. nonlinear: what re-tuned parameters can take up, which is in
    line with the motion, does not count. None where none explains anything.
    """
    axes = range(evidence.command.shape[1]) if site == ALL_SITES else (site,)
    step_s = 1 / evidence.sample_rate_hz
    looks = [_look(evidence, axis, nonlinear) for axis in axes]
    used = np.flatnonzero(evidence.used > 0)

    def left(value: float) -> float:
        total = 0.0
        for axis, (force, basis) in zip(axes, looks, strict=True):
            commanded = evidence.command[:, axis]
            added = change(commanded, step_s, value) - commanded
            total += min(_misfit(force - np.roll(added, shift)[used], basis) for shift in SHIFTS)
        return total

    if not len(grid):
        return None
    best, misfit = best_on_grid(left, grid)
    return best if misfit < (1 - LEAST_SHARE) * sum(_misfit(force, basis) for force, basis in looks) else None


def best_on_grid(misfit: Callable[[float], float], grid: Sequence[float]) -> tuple[float, float]:
    """The grid's best value (rising, above zero), refined between its neighbours, with its misfit."""
    values = [misfit(value) for value in grid]
    best = int(np.argmin(values))
    low, high = grid[max(best - 1, 0)], grid[min(best + 1, len(grid) - 1)]
    finer = minimize_scalar(
        lambda log: misfit(float(np.exp(log))),
        bounds=(float(np.log(low)), float(np.log(high))),
        method="bounded",
        options={"xatol": CLOSE, "maxiter": TRIES},
    )
    return (float(np.exp(finer.x)), float(finer.fun)) if finer.fun < values[best] else (grid[best], values[best])


def grid_of_peaks(evidence: Evidence, site: int, count: int = 12) -> list[float]:
    """Forces from a small one to the strongest commanded."""
    commanded = evidence.command if site == ALL_SITES else evidence.command[:, site]
    peak = float(np.abs(commanded).max())
    return list(np.geomspace(0.03 * peak, 0.995 * peak, count)) if peak > 0 else []


def _look(evidence: Evidence, axis: int, nonlinear: bool) -> tuple[FloatArray, FloatArray]:
    """The missing force where samples count, and an orthonormal basis (k, columns) of what does not matter."""
    used, v = evidence.used > 0, evidence.axis_velocity[:, axis]
    force = evidence.axis_force[used, axis]
    if not nonlinear:
        return force, np.zeros((len(force), 0))
    motion = np.column_stack([evidence.axis_position[:, axis], v, np.gradient(v)])[used]
    return force, np.linalg.qr(motion / np.maximum(np.linalg.norm(motion, axis=0), np.finfo(float).tiny))[0]


def _misfit(rest: FloatArray, basis: FloatArray) -> float:
    along = basis.T @ rest
    return float(rest @ rest - along @ along)
