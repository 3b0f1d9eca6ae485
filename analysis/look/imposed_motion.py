"""Decide which of two signals was imposed: the motion, with a measured force, or the force, with a measured motion.

Testing machines, shakers and drives impose ramps and sines. For both, the speed squared is a quadratic in the position:
v^2 = p + q x + r x^2, with q = r = 0 for ramps of constant speed and r = -w^2 for a sine of angular frequency w. The
quadratic is fitted by trimmed least squares in stretches of a few half cycles, so that amplitude and rate may change
between stretches. A random command, and the response of a device with mass, friction or a nonlinear force, do not obey
it.
"""

import numpy as np

from equalizer.signals.signal import FloatArray

_BLOCKS = 32
"""Block means per half cycle: enough averaging against noise, and short enough to keep corners sharp."""
_HALF_CYCLES = 4
"""Length, in half cycles, of the stretches in which the motion is compared with ramps or sinusoids."""
_REVERSAL = 0.1
"""Least reversal that ends a half cycle, as a fraction of the signal's range."""
_TRIM_QUANTILE = 0.7
"""Fraction of the samples that a fit keeps: the rest lie at the corners of ramps and trapezoids. Also the fraction of
unchanged samples above which a signal is a series of steps."""
_REST_SHARE = 0.1
"""Speed squared below which the signal rests, as between the ramps of a trapezoid, relative to its 90 % quantile."""
LARGEST_MISFIT = 0.1
"""Misfit below which a signal obeys the law of ramps or sines; that of a random signal is about 0.25."""
LEAST_MISFIT_RATIO = 3.0
"""Least ratio of the force's misfit to the motion's at which the motion is the command."""


def is_imposed(motion: FloatArray, force: FloatArray) -> bool:
    """Whether the motion (n,) obeys the law of ramps, or of ramps and sines, and the force (n,) clearly less so."""
    for ramps in (True, False):
        motion_misfit, force_misfit = law_misfit(motion, ramps=ramps), law_misfit(force, ramps=ramps)
        if motion_misfit < LARGEST_MISFIT and force_misfit > max(
            LARGEST_MISFIT / 2, LEAST_MISFIT_RATIO * motion_misfit
        ):
            return True
    return False


def law_misfit(values: FloatArray, *, ramps: bool = False) -> float:
    """Mean absolute residual of the fit relative to the mean speed squared, median over the stretches of a signal (n,).
    ramps: fit a constant in place of the quadratic. 0 for a series of steps; 1 where the samples do not suffice."""
    is_finite = np.isfinite(values)
    if is_finite.sum() < 2 * _BLOCKS or not np.ptp(values[is_finite]) > 0:
        return 1.0
    interpolated = np.interp(np.arange(len(values)), np.flatnonzero(is_finite), values[is_finite])
    interpolated = (interpolated - interpolated.mean()) / np.ptp(interpolated)
    if (
        np.mean(np.diff(interpolated) == 0) > _TRIM_QUANTILE
        and len(np.unique(interpolated)) < len(interpolated) / _BLOCKS
    ):
        return 0.0
    half_cycles = _half_cycles(interpolated)
    size = max(len(interpolated) // (half_cycles * _BLOCKS), 1)
    means = interpolated[: len(interpolated) // size * size].reshape(-1, size).mean(axis=1)
    length = _HALF_CYCLES * _BLOCKS
    starts = range(0, max(len(means) - length // 2, 1), length)
    return float(np.median([_misfit(means[start : start + length], 1 if ramps else 3) for start in starts]))


def _half_cycles(values: FloatArray) -> int:
    """Number of half cycles: reversals by more than `_REVERSAL`, plus one. values: (n,), scaled to a range of 1."""
    count, rising, extreme = 1, bool(values[len(values) // 2] > values[0]), float(values[0])
    for value in values.tolist():
        if (value > extreme) == rising:
            extreme = value
        elif abs(value - extreme) > _REVERSAL:
            count, rising, extreme = count + 1, not rising, value
    return count


def _misfit(values: FloatArray, count: int) -> float:
    """Misfit of one stretch of block means (m,), with the first `count` terms of the quadratic; 1 where the blocks do
    not suffice. Three least-squares fits, each without the samples that fitted worst before."""
    if len(values) < _BLOCKS // 2:
        return 1.0
    squared = ((values[4:] - values[:-4]) / 4) ** 2
    above_rest = squared > _REST_SHARE * np.quantile(squared, 0.9)
    positions, squared = values[2:-2][above_rest], squared[above_rest]
    if len(positions) < _BLOCKS // 4:
        return 1.0
    terms = np.stack([np.ones_like(positions), positions, positions**2], axis=1)[:, :count]
    well_fitted = np.full(len(positions), True)
    for _ in range(3):
        coefficients = np.linalg.lstsq(terms[well_fitted], squared[well_fitted], rcond=None)[0]
        residual = np.abs(squared - terms @ coefficients)
        well_fitted = residual <= np.quantile(residual, _TRIM_QUANTILE)
    scale = float(np.mean(squared))
    return float(np.mean(residual[well_fitted])) / scale if scale > 0 else 0.0
