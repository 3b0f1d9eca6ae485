"""Decide which of two signals was imposed: the motion, with a measured force, or the force, with a measured motion.

Testing machines, shakers and drives impose ramps and sines. For both, the speed squared is a quadratic in the position:
v^2 = p + q x + r x^2, with q = r = 0 for ramps of constant speed and r = -w^2 for a sine of angular frequency w. The
quadratic is fitted by trimmed least squares in stretches of a few half cycles, so that amplitude and rate may change
between stretches. A random command, and the response of a device with mass, friction or a nonlinear force, do not obey
it.
"""

import numpy as np

from equalizer.signals.signal import FloatArray

_BLOCKS_PER_HALF_CYCLE = 32
"""Block means per half cycle: chosen to average noise and to keep corners sharp."""
_HALF_CYCLES_PER_STRETCH = 4
"""Length, in half cycles, of the stretches in which the motion is compared with ramps or sinusoids. Chosen."""
_LEAST_REVERSAL_FRACTION = 0.1
"""Change against the direction of motion above which a half cycle ends, as a fraction of the signal's range: chosen
above the noise of a sensor."""
_KEPT_FRACTION = 0.7
"""Fraction of the samples that a fit keeps: the rest lie at the corners of ramps and trapezoids. Also the fraction of
unchanged samples above which a signal is a series of steps. Chosen."""
_REST_SPEED_FRACTION = 0.1
"""Speed squared below which the signal rests, as between the ramps of a trapezoid, relative to its 90 % quantile.
Chosen."""
LARGEST_MISFIT = 0.1
"""Misfit below which a signal obeys the law of ramps or sines: chosen well below that of a random signal, about
0.25."""
LEAST_MISFIT_RATIO = 3.0
"""Ratio of the force's misfit to the motion's above which the motion is the command. Chosen."""


def is_motion_imposed(motion: FloatArray, force: FloatArray) -> bool:
    """Whether the motion (n,), of any unit, obeys the law of ramps, or that of ramps and sines, with a misfit below
    `LARGEST_MISFIT`, and the force (n,) has by the same law a misfit above both half that limit and
    `LEAST_MISFIT_RATIO` times that of the motion."""
    for is_ramp_law in (True, False):
        motion_misfit, force_misfit = (
            compute_law_misfit(motion, is_ramp_law=is_ramp_law),
            compute_law_misfit(force, is_ramp_law=is_ramp_law),
        )
        if motion_misfit < LARGEST_MISFIT and force_misfit > max(
            LARGEST_MISFIT / 2, LEAST_MISFIT_RATIO * motion_misfit
        ):
            return True
    return False


def compute_law_misfit(signal: FloatArray, *, is_ramp_law: bool = False) -> float:
    """Compute the mean absolute residual of the fit relative to the mean speed squared, median over the stretches of a
    signal (n,), NaN where a sample is missing. is_ramp_law: fit a constant in place of the quadratic. 0 for a series of
    steps; 1 where all samples are equal, or fewer than twice `_BLOCKS_PER_HALF_CYCLE` are finite."""
    is_finite = np.isfinite(signal)
    if is_finite.sum() < 2 * _BLOCKS_PER_HALF_CYCLE or not np.ptp(signal[is_finite]) > 0:
        return 1.0
    filled_signal = np.interp(np.arange(len(signal)), np.flatnonzero(is_finite), signal[is_finite])
    filled_signal = (filled_signal - filled_signal.mean()) / np.ptp(filled_signal)
    if (
        np.mean(np.diff(filled_signal) == 0) > _KEPT_FRACTION
        and len(np.unique(filled_signal)) < len(filled_signal) / _BLOCKS_PER_HALF_CYCLE
    ):
        return 0.0
    half_cycle_count = _count_half_cycles(filled_signal)
    block_samples = max(len(filled_signal) // (half_cycle_count * _BLOCKS_PER_HALF_CYCLE), 1)
    block_means = (
        filled_signal[: len(filled_signal) // block_samples * block_samples].reshape(-1, block_samples).mean(axis=1)
    )
    stretch_blocks = _HALF_CYCLES_PER_STRETCH * _BLOCKS_PER_HALF_CYCLE
    stretch_starts = range(0, max(len(block_means) - stretch_blocks // 2, 1), stretch_blocks)
    return float(
        np.median(
            [
                _compute_stretch_misfit(
                    block_means[stretch_start : stretch_start + stretch_blocks], 1 if is_ramp_law else 3
                )
                for stretch_start in stretch_starts
            ]
        )
    )


def _count_half_cycles(scaled_signal: FloatArray) -> int:
    """Count the half cycles: reversals by more than `_LEAST_REVERSAL_FRACTION`, plus one. scaled_signal: (n,), with a
    range of 1."""
    half_cycle_count, is_rising, latest_extreme = (
        1,
        bool(scaled_signal[len(scaled_signal) // 2] > scaled_signal[0]),
        float(scaled_signal[0]),
    )
    for sample in scaled_signal.tolist():
        if (sample > latest_extreme) == is_rising:
            latest_extreme = sample
        elif abs(sample - latest_extreme) > _LEAST_REVERSAL_FRACTION:
            half_cycle_count, is_rising, latest_extreme = half_cycle_count + 1, not is_rising, sample
    return half_cycle_count


def _compute_stretch_misfit(block_means: FloatArray, term_count: int) -> float:
    """Compute the misfit of one stretch of block means (m,) to the first `term_count` terms of the quadratic; 1 for
    fewer than half `_BLOCKS_PER_HALF_CYCLE` blocks, or than a quarter of it in motion. Trimmed least squares: three
    fits, each to the `_KEPT_FRACTION` of the blocks with the smallest residuals of the fit before."""
    if len(block_means) < _BLOCKS_PER_HALF_CYCLE // 2:
        return 1.0
    speed_squared = ((block_means[4:] - block_means[:-4]) / 4) ** 2
    is_moving = speed_squared > _REST_SPEED_FRACTION * np.quantile(speed_squared, 0.9)
    positions, speed_squared = block_means[2:-2][is_moving], speed_squared[is_moving]
    if len(positions) < _BLOCKS_PER_HALF_CYCLE // 4:
        return 1.0
    regressors = np.stack([np.ones_like(positions), positions, positions**2], axis=1)[:, :term_count]
    is_well_fitted = np.full(len(positions), True)
    for _ in range(3):
        coefficients = np.linalg.lstsq(regressors[is_well_fitted], speed_squared[is_well_fitted], rcond=None)[0]
        residual = np.abs(speed_squared - regressors @ coefficients)
        is_well_fitted = residual <= np.quantile(residual, _KEPT_FRACTION)
    mean_speed_squared = float(np.mean(speed_squared))
    return float(np.mean(residual[is_well_fitted])) / mean_speed_squared if mean_speed_squared > 0 else 0.0
