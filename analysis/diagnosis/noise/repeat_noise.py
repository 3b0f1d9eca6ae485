"""Estimate noise from the differences between repeated periods.

Noise is taken not to depend on the excitation, whereas variations of the device between periods grow with it. Therefore
the segments with the smallest variance are averaged and, where others are larger and even these exceed the noise at
rest, the noise at rest is used. Densities are as in `ChannelNoise`: mean over lines = variance, in the channel's unit
squared.
"""

from collections.abc import Sequence

import numpy as np
from scipy.special import fdtri

from analysis.diagnosis.noise.channel_noise import ChannelNoise, SegmentNoise
from analysis.diagnosis.noise.periods import Periods, compute_period_spectra, stack_periods
from analysis.diagnosis.noise.quiet_noise import estimate_fast_rest_noise
from analysis.diagnosis.noise.rounding import find_rounding_step, undo_rounding
from analysis.diagnosis.types import Mask
from equalizer.identification.frequency_response.noise_floor import compute_period_variance, smooth_over_lines
from equalizer.signals.recording import Recording
from equalizer.signals.signal import FloatArray

_SMOOTHED_LINES = 9
"""Number of lines over which the variance between periods is averaged. Chosen."""
_SIGNIFICANCE = 1e-4
"""Significance level of the F test for equal noise. Chosen."""
_LEAST_STEPS = 1.2
"""Least standard deviation of a motion, in rounding steps, for a segment to be used. Chosen: below it, rounding may
hide noise or add to it."""
_SMALLEST_NORMAL = np.finfo(np.float64).tiny
"""Lower limit of divisors, against division by zero."""


def estimate_repeat_noise(
    recording: Recording, samples: FloatArray, periods: Sequence[Periods], lines_hz: FloatArray
) -> ChannelNoise:
    """Estimate the noise of each channel from the differences between periods. samples: (n, channels); periods: at
    least two of each segment; lines_hz: (lines,), frequencies of the estimated density."""
    segment_estimates = [_estimate_period_variance(recording, samples, period, lines_hz) for period in periods]
    density, freedom = (
        np.stack([segment_density for segment_density, _ in segment_estimates]),
        np.stack([segment_freedom for _, segment_freedom in segment_estimates]),
    )
    variance = density.mean(axis=1)
    is_moving = _mask_moving_channels(samples, periods)
    is_pooled = is_moving & mask_quietest(np.where(is_moving, variance, np.inf), freedom)
    weights = np.where(is_pooled, freedom, 0.0)
    pooled_density = np.einsum("sc,slc->lc", weights, density) / weights.sum(axis=0)
    pooled_freedom = weights.sum(axis=0)
    is_varying = np.asarray(is_moving & ~is_pooled)
    smoothed_density = smooth_over_lines(pooled_density, _SMOOTHED_LINES)
    smoothed_density *= pooled_density.mean(axis=0) / np.maximum(smoothed_density.mean(axis=0), _SMALLEST_NORMAL)
    limited_density, is_above_rest = _limit_to_rest_noise(
        recording, samples, smoothed_density, pooled_freedom, np.asarray(is_varying.any(axis=0))
    )
    total_density, rounding = add_repeating_rounding(limited_density, samples)
    segments = tuple(
        SegmentNoise(
            period.index,
            period.segment.amplitude,
            variance[segment_row],
            freedom[segment_row],
            tuple(is_pooled[segment_row].tolist()),
            tuple(is_varying[segment_row].tolist()),
        )
        for segment_row, period in enumerate(periods)
    )
    return ChannelNoise(
        np.sqrt(total_density.mean(axis=0)),
        total_density,
        pooled_freedom,
        rounding,
        segments,
        tuple(is_above_rest.tolist()),
    )


def add_repeating_rounding(density: FloatArray, samples: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Add the part of the rounding error that repeats in each period to the density (lines, channels). Returns the sum,
    and that part alone, (channels,); it is 0 where the variance is not finite."""
    repeating_variances = [
        undo_rounding(float(variance), find_rounding_step(channel)).repeating if np.isfinite(variance) else 0.0
        for variance, channel in zip(density.mean(axis=0), samples.T, strict=True)
    ]
    rounding: FloatArray = np.array(repeating_variances)
    return density + rounding, rounding


def mask_quietest(variance: FloatArray, freedom: FloatArray) -> Mask:
    """Mask (rows, channels) of the variances that are not significantly larger than the smallest of their column (F
    test, `_SIGNIFICANCE`). variance, freedom: (rows, channels), variances and their degrees of freedom."""
    quietest_rows = np.argmin(variance, axis=0)
    columns = np.arange(variance.shape[1])
    largest_ratio = _compute_largest_ratio(freedom, freedom[quietest_rows, columns])
    return np.asarray(variance <= largest_ratio * variance[quietest_rows, columns], dtype=np.bool_)


def count_equal_lines(density: FloatArray) -> FloatArray:
    """Compute the equivalent number of independent lines of equal power, (channels,), at least 1: (sum P)² / sum P².
    density: (lines, channels)."""
    line_count: FloatArray = density.sum(axis=0) ** 2 / np.maximum(np.sum(density**2, axis=0), _SMALLEST_NORMAL)
    return np.maximum(line_count, 1.0)


def _estimate_period_variance(
    recording: Recording, samples: FloatArray, periods: Periods, lines_hz: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Estimate the density (lines, channels) of the variance between the periods of a segment, interpolated to
    lines_hz, and its degrees of freedom, (channels,)."""
    density = compute_period_variance(compute_period_spectra(samples, periods)) * periods.length
    freedom = 2 * (periods.count - 1) * count_equal_lines(smooth_over_lines(density, _SMOOTHED_LINES))
    period_lines_hz = periods.compute_line_frequencies(recording.sample_rate_hz)
    if len(period_lines_hz) != len(lines_hz):
        density = np.stack([np.interp(lines_hz, period_lines_hz, channel) for channel in density.T], axis=1)
    return density, freedom


def _mask_moving_channels(samples: FloatArray, periods: Sequence[Periods]) -> Mask:
    """Mask (segments, channels) of the channels that move by at least `_LEAST_STEPS` rounding steps; True in all
    segments for a channel that moves by less in all of them."""
    rounding_steps = np.array([find_rounding_step(channel) for channel in samples.T])
    is_moving = np.array(
        [stack_periods(samples, period).std(axis=(0, 1)) >= _LEAST_STEPS * rounding_steps for period in periods]
    )
    return np.asarray(is_moving | ~is_moving.any(axis=0), dtype=np.bool_)


def _limit_to_rest_noise(
    recording: Recording, samples: FloatArray, density: FloatArray, freedom: FloatArray, is_varying: Mask
) -> tuple[FloatArray, Mask]:
    """Replace the density by the noise at rest in channels with varying variance (`is_varying`) that significantly
    exceed it, except at lines with a significantly lower density. Returns density (lines, channels) and mask
    (channels,) of these channels; unchanged, and False, where the recording has no noise at rest, or no channel varies.
    density: smoothed over lines; freedom: (channels,), of its mean over lines."""
    no_channel = np.zeros(len(is_varying), dtype=np.bool_)
    fast_noise = estimate_fast_rest_noise(recording, samples)
    if fast_noise is None or not is_varying.any():
        return density, no_channel
    is_quietest = mask_quietest(fast_noise.variance, fast_noise.freedom)
    weights = np.where(is_quietest, fast_noise.freedom, 0.0)
    rest_variance = np.sum(weights * fast_noise.variance, axis=0) / weights.sum(axis=0)
    is_above_rest = (
        is_varying
        & (density.mean(axis=0) > _compute_largest_ratio(freedom, weights.sum(axis=0)) * rest_variance)
        & (rest_variance > 0)
    )
    # Taking the smaller of two estimates of the same noise would be biased: a line keeps only a much lower density.
    line_freedom = np.maximum(freedom * _SMOOTHED_LINES / len(density), 1.0)
    is_lower = rest_variance > _compute_largest_ratio(weights.sum(axis=0), line_freedom) * density
    return np.where(is_above_rest & ~is_lower, rest_variance, density), np.asarray(is_above_rest, dtype=np.bool_)


def _compute_largest_ratio(freedom: FloatArray, denominator_freedom: FloatArray) -> FloatArray:
    """Compute the ratio of two variances of equal noise that is exceeded with probability `_SIGNIFICANCE`, from the
    degrees of freedom of numerator and denominator."""
    return np.asarray(fdtri(freedom, denominator_freedom, 1 - _SIGNIFICANCE))
