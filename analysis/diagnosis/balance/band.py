"""The band in which accelerations and positions can be computed from a measured motion, given its white noise.

With the power spectral density S(f) of the motion and the density N of its white noise, differentiation multiplies both
by f^(2k), k = number of derivatives to the acceleration; double integration of an acceleration multiplies them by f^-4.
The band ends (begins) where the noise power summed over the band is at most `ACCELERATION_NOISE_SHARE` (a hundredth) of
the signal power. On a noisier regressor, least squares would underestimate the mass (errors in variables; see
`motion`).
"""

from collections.abc import Sequence

import numpy as np

from analysis.diagnosis.limits import ACCELERATION_NOISE_SHARE, HIGHEST_BAND_END_RATIO, LEAST_BAND_END_CYCLES
from equalizer.signals.signal import FloatArray
from equalizer.signals.spectral_density import estimate_spectral_density

LEAST_BAND_BEGIN_CYCLES = 4.0
"""Least lower end of the band, in cycles of the shortest recording that counts: an integral over a finite recording is
wrong at lower frequencies. Chosen."""
LEAST_LENGTH_SHARE = 0.1
"""Least length of a recording that counts, relative to the length such that recordings at least as long hold half of
all samples. Chosen. A shorter one, with fewer than `LEAST_BAND_BEGIN_CYCLES` cycles of the band's lower end, has no
valid sample (`Motion.mask_valid_samples`)."""
MOST_SEGMENT_SAMPLES = 4096
"""Largest number of samples in a segment from which the spectral density is estimated. Chosen."""


def compute_band_end_hz(samples: Sequence[FloatArray], rate_hz: float, order: int) -> float:
    """Compute the upper end of the band in Hz: median over the recordings' channels that have usable lines, at least
    `LEAST_BAND_END_CYCLES` cycles in the longest recording, at most `HIGHEST_BAND_END_RATIO` of the sample rate.
    Recordings far shorter than most do not count (`LEAST_LENGTH_SHARE`). samples: (n, d) each. order: time derivative
    of the position that was measured (0, 1 or 2)."""
    usable_lines_hz = [
        _find_usable_lines_hz(column - np.linspace(column[0], column[-1], len(column)), rate_hz, 2 * (2 - order))
        for column in _list_counted_columns(samples)
    ]
    upper_ends_hz = [lines_hz[-1] for lines_hz in usable_lines_hz if len(lines_hz)] or [rate_hz / MOST_SEGMENT_SAMPLES]
    longest_samples = max(len(recording_samples) for recording_samples in samples)
    return float(
        np.clip(
            np.median(upper_ends_hz),
            LEAST_BAND_END_CYCLES * rate_hz / longest_samples,
            HIGHEST_BAND_END_RATIO * rate_hz,
        )
    )


def compute_band_begin_hz(samples: Sequence[FloatArray], rate_hz: float) -> float:
    """Compute the lower end in Hz of the band in which accelerations are integrated twice: median over the recordings'
    channels that have usable lines, at least `LEAST_BAND_BEGIN_CYCLES`. Recordings far shorter than most do not
    count. samples: accelerations (n, d) each."""
    columns = _list_counted_columns(samples)
    usable_lines_hz = [_find_usable_lines_hz(column, rate_hz, -4) for column in columns]
    lower_ends_hz = [lines_hz[0] for lines_hz in usable_lines_hz if len(lines_hz)] or [rate_hz / MOST_SEGMENT_SAMPLES]
    shortest_samples = min(map(len, columns or samples))
    return max(float(np.median(lower_ends_hz)), LEAST_BAND_BEGIN_CYCLES * rate_hz / shortest_samples)


def _list_counted_columns(samples: Sequence[FloatArray]) -> list[FloatArray]:
    """List the channels (n,) of each recording that count: those that vary, because a constant reading, as of an axis
    at rest, has no noise to measure, and that are not far shorter than most (`LEAST_LENGTH_SHARE`)."""
    columns = [column for recording_samples in samples for column in recording_samples.T if np.ptp(column) > 0]
    lengths = np.sort([len(column) for column in columns])[::-1]
    usual_length = lengths[np.searchsorted(np.cumsum(lengths), lengths.sum() / 2)] if columns else 0
    return [column for column in columns if len(column) >= LEAST_LENGTH_SHARE * usual_length]


def _find_usable_lines_hz(column: FloatArray, rate_hz: float, exponent: int) -> FloatArray:
    """Find the frequencies (lines,) in Hz up to which (exponent < 0: from which on) the noise of a channel (n,) is at
    most `ACCELERATION_NOISE_SHARE` of its signal power, both weighted by f^exponent; none for mere noise."""
    frequency_hz, density, noise_density = _estimate_signal_and_noise_density(column, rate_hz)
    if exponent < 0:  # the mean that is removed from each windowed segment leaks into its first line
        frequency_hz, density = frequency_hz[1:], density[1:]
    weights = frequency_hz ** float(exponent)
    order = slice(None, None, -1 if exponent < 0 else 1)
    signal_power = np.cumsum((np.maximum(density - noise_density, 0.0) * weights)[order])[order]
    noise_power = np.cumsum((noise_density * weights)[order])[order]
    return np.asarray(frequency_hz[noise_power <= ACCELERATION_NOISE_SHARE * signal_power])


def estimate_white_noise_density(column: FloatArray, rate_hz: float) -> float:
    """Estimate the spectral density of the white noise of a channel (n,): one-sided, in squared units per Hz."""
    line = np.linspace(column[0], column[-1], len(column))
    return _estimate_signal_and_noise_density(column - line, rate_hz)[2]


def _estimate_signal_and_noise_density(column: FloatArray, rate_hz: float) -> tuple[FloatArray, FloatArray, float]:
    """Estimate the spectral density of a channel (n,). Returns the frequencies (lines,) above 0 in Hz, the density
    (lines,) there in squared units per Hz, and that of its white noise: the median over the upper quarter of the
    lines."""
    frequency_hz, density = estimate_spectral_density(column, rate_hz, MOST_SEGMENT_SAMPLES)
    return frequency_hz[1:], density[1:], float(np.median(density[1 + 3 * (len(density) - 1) // 4 :]))
