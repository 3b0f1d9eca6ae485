"""Starting values of actuator effects, from the missing force at a driven axis.

An effect changes the command u to the force f(u, p). The parameter p is sought for which f(u, p) - u leaves the least
of the missing force, in the sense of least squares; terms that a re-tuned linear model may have absorbed are projected
out where the effect asks for it. Search: grid, then golden section on the logarithm of p.
"""

from collections.abc import Callable, Sequence

import numpy as np

from equalizer.effects.effect import ALL_SITES
from equalizer.effects.starts.evidence import Evidence
from equalizer.signals.signal import FloatArray

LEAST_EXPLAINED_SHARE = 1e-3
"""Least share of the missing force's sum of squares that a value must explain to become a starting value. Chosen."""
DELAYS_SAMPLES = (0, 1)
"""Delays (samples) of the missing force against the effect's force that are tried; the better one counts. Chosen."""
LOG_TOLERANCE = 3e-3
"""Relative tolerance of the parameter in the golden-section search. Chosen."""
GOLDEN_SHARE = (5**0.5 - 1) / 2
"""Golden ratio less 1: the factor by which golden-section search shrinks its interval."""


def find_command_parameter(
    evidence: Evidence,
    site: int,
    change: Callable[[FloatArray, float, float], FloatArray],
    grid: Sequence[float],
    project_out_motion: bool,
) -> float | None:
    """Find the parameter value whose changed command leaves the least missing force, by grid search refined by golden
    section. None where no value explains the share `LEAST_EXPLAINED_SHARE`, or the grid is empty.

    site: axis, or ALL_SITES for one value at all axes. change: maps samples (n,), their period in s and a value to
    changed samples. grid: ascending, > 0. project_out_motion: whether to project out position, velocity and
    acceleration, whose coefficients re-tuning may have absorbed.
    """
    axes = range(evidence.command.shape[1]) if site == ALL_SITES else (site,)
    step_s = 1 / evidence.sample_rate_hz
    forces = [_compute_force_and_basis(evidence, axis, project_out_motion) for axis in axes]
    used_indices = np.flatnonzero(evidence.used > 0)

    def compute_misfit_sum(value: float) -> float:
        """Compute the sum over the axes of the missing force that a value leaves, at the better of the delays."""
        misfit_sum = 0.0
        for axis, (force, basis) in zip(axes, forces, strict=True):
            commanded = evidence.command[:, axis]
            force_change = change(commanded, step_s, value) - commanded
            misfit_sum += min(
                _compute_misfit(force - np.roll(force_change, shift)[used_indices], basis) for shift in DELAYS_SAMPLES
            )
        return misfit_sum

    if not len(grid):
        return None
    best_value, misfit = minimise_on_grid(compute_misfit_sum, grid)
    return (
        best_value
        if misfit < (1 - LEAST_EXPLAINED_SHARE) * sum(_compute_misfit(force, basis) for force, basis in forces)
        else None
    )


def fit_square_law(evidence: Evidence, site: int) -> tuple[float, float] | None:
    """Fit (square, reference in N) of `force_nonlinearity.apply_square_law` by regression of the missing force on u and
    u |u|; None where the quadratic term explains too little, the force at the strongest command is not positive, or
    |square| is 0 or exceeds 1. Coefficients are averaged over the axes of the site."""
    axes = range(evidence.command.shape[1]) if site == ALL_SITES else (site,)
    used_indices, linear_gains, square_gains, explained_share = np.flatnonzero(evidence.used > 0), [], [], 0.0
    for axis in axes:
        force, basis = _compute_force_and_basis(evidence, axis, True)
        u = evidence.command[used_indices, axis]
        regressors = np.column_stack([u, u * np.abs(u)])
        regressors -= basis @ (basis.T @ regressors)
        force = force - basis @ (basis.T @ force)
        linear_fit, square_fit = (
            np.linalg.lstsq(regressors[:, :column_count], force, rcond=None)[0] for column_count in (1, 2)
        )
        linear_gains.append(1 + float(square_fit[0]))
        square_gains.append(float(square_fit[1]))
        # Sums of squares without and with the quadratic term.
        linear_misfit, square_misfit = (
            float(np.sum((force - regressors[:, : len(coefficients)] @ coefficients) ** 2))
            for coefficients in (linear_fit, square_fit)
        )
        explained_share += (linear_misfit - square_misfit) / max(linear_misfit, 1e-300) / len(axes)
    mean_linear_gain, mean_square_gain = float(np.mean(linear_gains)), float(np.mean(square_gains))
    strongest_command = float(np.abs(evidence.command[:, list(axes)]).max(initial=0.0))
    gain_at_peak = mean_linear_gain + mean_square_gain * strongest_command
    if explained_share < LEAST_EXPLAINED_SHARE or gain_at_peak <= 0:
        return None
    # Force and command agree at the reference. If that is not positive or at least ten times (chosen) the strongest
    # command, the gain is wrong as well; the strongest command is then the reference.
    equal_command = (1 - mean_linear_gain) / mean_square_gain if mean_square_gain else 0.0
    square_share, reference = (
        (1 - mean_linear_gain, equal_command)
        if 0 < equal_command < 10 * strongest_command
        else (mean_square_gain * strongest_command / gain_at_peak, strongest_command)
    )
    return (square_share, reference) if square_share and -1 <= square_share <= 1 else None


def minimise_on_grid(misfit: Callable[[float], float], grid: Sequence[float]) -> tuple[float, float]:
    """Minimise a misfit on a grid (ascending, > 0), refined between the neighbours of the best point; returns the value
    and its misfit."""
    misfits = [misfit(value) for value in grid]
    best_index = int(np.argmin(misfits))
    lower_neighbour, upper_neighbour = grid[max(best_index - 1, 0)], grid[min(best_index + 1, len(grid) - 1)]
    refined = _search_golden_section(misfit, float(np.log(lower_neighbour)), float(np.log(upper_neighbour)))
    return refined if refined[1] < misfits[best_index] else (grid[best_index], misfits[best_index])


def _search_golden_section(misfit: Callable[[float], float], lower_log: float, upper_log: float) -> tuple[float, float]:
    """Search the minimum between two values, given by their natural logarithms: golden-section search (Kiefer 1953,
    Proc. AMS 4:502). Returns the value and its misfit."""
    log_points = [
        upper_log - GOLDEN_SHARE * (upper_log - lower_log),
        lower_log + GOLDEN_SHARE * (upper_log - lower_log),
    ]
    misfits = [misfit(float(np.exp(point))) for point in log_points]
    while upper_log - lower_log > 2 * LOG_TOLERANCE:
        if misfits[0] <= misfits[1]:
            upper_log, new_log_point = log_points[1], log_points[1] - GOLDEN_SHARE * (log_points[1] - lower_log)
            log_points, misfits = [new_log_point, log_points[0]], [misfit(float(np.exp(new_log_point))), misfits[0]]
        else:
            lower_log, new_log_point = log_points[0], log_points[0] + GOLDEN_SHARE * (upper_log - log_points[0])
            log_points, misfits = [log_points[1], new_log_point], [misfits[1], misfit(float(np.exp(new_log_point)))]
    best_index = int(np.argmin(misfits))
    return float(np.exp(log_points[best_index])), misfits[best_index]


def make_force_level_grid(evidence: Evidence, site: int, count: int = 12) -> list[float]:
    """Make a grid of force levels (N), from 3 % to 99.5 % of the strongest command at the site; empty where it is
    zero."""
    commanded = evidence.command if site == ALL_SITES else evidence.command[:, site]
    strongest_command = float(np.abs(commanded).max())
    return (
        list(np.geomspace(0.03 * strongest_command, 0.995 * strongest_command, count)) if strongest_command > 0 else []
    )


def _compute_force_and_basis(evidence: Evidence, axis: int, project_out_motion: bool) -> tuple[FloatArray, FloatArray]:
    """Compute the missing force (k,) at the samples with `evidence.used` > 0, and an orthonormal basis (k, columns) of
    position, velocity and acceleration; without columns unless project_out_motion."""
    is_used, velocity = evidence.used > 0, evidence.axis_velocity[:, axis]
    force = evidence.axis_force[is_used, axis]
    if not project_out_motion:
        return force, np.zeros((len(force), 0))
    motion = np.column_stack([evidence.axis_position[:, axis], velocity, np.gradient(velocity)])[is_used]
    return force, np.linalg.qr(motion / np.maximum(np.linalg.norm(motion, axis=0), np.finfo(float).tiny))[0]


def _compute_misfit(force: FloatArray, basis: FloatArray) -> float:
    """Compute the sum of squares of `force` (k,) that remains after projection on an orthonormal basis (k, columns)."""
    projection = basis.T @ force
    return float(force @ force - projection @ projection)
