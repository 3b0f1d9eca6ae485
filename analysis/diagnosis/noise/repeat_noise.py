"""Noise from the differences between repeated periods.

Noise does not depend on the excitation, whereas a device that varies or rattles differs more the more it is driven.
Therefore the quietest segments are used and, where even they vary more than the noise at rest, that noise.
"""

from collections.abc import Sequence

import numpy as np
from scipy.special import fdtri

from analysis.diagnosis.noise.channel_noise import ChannelNoise, SegmentNoise
from analysis.diagnosis.noise.periods import Periods, period_samples, period_spectra
from analysis.diagnosis.noise.quiet_noise import fast_noise_at_rest
from analysis.diagnosis.noise.rounding import rounding_step, undo_rounding
from analysis.diagnosis.types import Mask
from equalizer.identification.frequency_response.noise_floor import period_variance, smooth_over_lines
from equalizer.signals.recording import Recording
from equalizer.signals.signal import FloatArray

_SMOOTHED_LINES = 9
"""Lines over which the variance between periods is averaged."""
_ALIKE = 1e-4
"""Significance level of the test for equal noise."""
_STEPS_MOVED = 1.2
"""Least rms of a movement in rounding steps: below it, rounding may hide noise or add to it."""
_TINY = np.finfo(np.float64).tiny


def repeat_noise(
    recording: Recording, samples: FloatArray, periods: Sequence[Periods], lines_hz: FloatArray
) -> ChannelNoise:
    """Noise of each channel from the differences between periods. periods: at least two of each segment. lines_hz:
    where the density is wanted."""
    spreads = [_spread(recording, samples, period, lines_hz) for period in periods]
    density, freedom = np.stack([spread for spread, _ in spreads]), np.stack([free for _, free in spreads])
    variance = density.mean(axis=1)
    moved = _moves_over_steps(samples, periods)
    counted = moved & quietest(np.where(moved, variance, np.inf), freedom)
    weights = np.where(counted, freedom, 0.0)
    pooled = np.einsum("sc,slc->lc", weights, density) / weights.sum(axis=0)
    freedom_pooled = weights.sum(axis=0)
    varies = np.asarray(moved & ~counted)
    smooth = smooth_over_lines(pooled, _SMOOTHED_LINES)
    smooth *= pooled.mean(axis=0) / np.maximum(smooth.mean(axis=0), _TINY)
    floor, above_rest = _no_more_than_rest(recording, samples, smooth, freedom_pooled, np.asarray(varies.any(axis=0)))
    whole, rounding = with_rounding(floor, samples)
    segments = tuple(
        SegmentNoise(
            period.index,
            period.segment.amplitude,
            variance[k],
            freedom[k],
            tuple(counted[k].tolist()),
            tuple(varies[k].tolist()),
        )
        for k, period in enumerate(periods)
    )
    return ChannelNoise(
        np.sqrt(whole.mean(axis=0)), whole, freedom_pooled, rounding, segments, tuple(above_rest.tolist())
    )


def with_rounding(density: FloatArray, samples: FloatArray) -> tuple[FloatArray, FloatArray]:
    """The density with the repeating part of rounding, and that part alone: (lines, channels), (channels,)."""
    parts = [
        undo_rounding(float(variance), rounding_step(channel)).repeating if np.isfinite(variance) else 0.0
        for variance, channel in zip(density.mean(axis=0), samples.T, strict=True)
    ]
    rounding: FloatArray = np.array(parts)
    return density + rounding, rounding


def quietest(variance: FloatArray, freedom: FloatArray) -> Mask:
    """Mask (rows, channels) of the variances that do not differ significantly from the smallest of their column (F
    test). variance, freedom: (rows, channels), variances and their degrees of freedom."""
    least = np.argmin(variance, axis=0)
    columns = np.arange(variance.shape[1])
    bound = _largest_ratio(freedom, freedom[least, columns])
    return np.asarray(variance <= bound * variance[least, columns], dtype=np.bool_)


def equal_lines(density: FloatArray) -> FloatArray:
    """(channels,): equivalent number of independent lines of equal power. density: (lines, channels)."""
    equal: FloatArray = density.sum(axis=0) ** 2 / np.maximum(np.sum(density**2, axis=0), _TINY)
    return np.maximum(equal, 1.0)


def _spread(
    recording: Recording, samples: FloatArray, periods: Periods, lines_hz: FloatArray
) -> tuple[FloatArray, FloatArray]:
    density = period_variance(period_spectra(samples, periods)) * periods.length
    freedom = 2 * (periods.count - 1) * equal_lines(smooth_over_lines(density, _SMOOTHED_LINES))
    own_hz = periods.frequency_hz(recording.sample_rate_hz)
    if len(own_hz) != len(lines_hz):
        density = np.stack([np.interp(lines_hz, own_hz, channel) for channel in density.T], axis=1)
    return density, freedom


def _moves_over_steps(samples: FloatArray, periods: Sequence[Periods]) -> Mask:
    """(segments, channels): whether a channel moves over its rounding steps; True for all where it never does."""
    steps = np.array([rounding_step(channel) for channel in samples.T])
    moved = np.array([period_samples(samples, period).std(axis=(0, 1)) >= _STEPS_MOVED * steps for period in periods])
    return np.asarray(moved | ~moved.any(axis=0), dtype=np.bool_)


def _no_more_than_rest(
    recording: Recording, samples: FloatArray, density: FloatArray, freedom: FloatArray, varied: Mask
) -> tuple[FloatArray, Mask]:
    """The density of the noise at rest, in channels whose segments varied and all exceed it; but at lines where the
    given density is significantly lower. density: smoothed over lines."""
    none = np.zeros(len(varied), dtype=np.bool_)
    hiss = fast_noise_at_rest(recording, samples)
    if hiss is None or not varied.any():
        return density, none
    at_rest = quietest(hiss.variance, hiss.freedom)
    weights = np.where(at_rest, hiss.freedom, 0.0)
    rest = np.sum(weights * hiss.variance, axis=0) / weights.sum(axis=0)
    above_rest = varied & (density.mean(axis=0) > _largest_ratio(freedom, weights.sum(axis=0)) * rest) & (rest > 0)
    # The smaller of both at each line would be too small on average: of two estimates of one noise, the lower.
    of_line = np.maximum(freedom * _SMOOTHED_LINES / len(density), 1.0)
    lower = rest > _largest_ratio(weights.sum(axis=0), of_line) * density
    return np.where(above_rest & ~lower, rest, density), np.asarray(above_rest, dtype=np.bool_)


def _largest_ratio(freedom: FloatArray, others: FloatArray) -> FloatArray:
    """Ratio of two variances of equal noise, exceeded with probability `_ALIKE`, by their degrees of freedom."""
    return np.asarray(fdtri(freedom, others, 1 - _ALIKE))
