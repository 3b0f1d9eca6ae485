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
    floor, above_rest = _no_more_than_rest(recording, samples, pooled, freedom_pooled, np.asarray(varies.any(axis=0)))
    smooth = smooth_over_lines(floor, _SMOOTHED_LINES)
    smooth *= floor.mean(axis=0) / np.maximum(smooth.mean(axis=0), _TINY)
    whole, rounding = with_rounding(smooth, samples)
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
    bound = fdtri(freedom, freedom[least, columns], 1 - _ALIKE)
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
    """The density, capped by the noise at rest in channels whose segments varied and all exceed it."""
    none = np.zeros(len(varied), dtype=np.bool_)
    hiss = fast_noise_at_rest(recording, samples)
    if hiss is None or not varied.any():
        return density, none
    at_rest = quietest(hiss.variance, hiss.freedom)
    weights = np.where(at_rest, hiss.freedom, 0.0)
    rest = np.sum(weights * hiss.variance, axis=0) / weights.sum(axis=0)
    bound = fdtri(freedom, weights.sum(axis=0), 1 - _ALIKE)
    above_rest = varied & (density.mean(axis=0) > bound * rest) & (rest > 0)
    return np.where(above_rest, np.minimum(density, rest), density), np.asarray(above_rest, dtype=np.bool_)
