"""The band in which accelerations and positions can be computed from a measured motion, given its white noise.

With the power spectral density S(f) of the motion and the density N of its white noise, differentiation multiplies both
by f^(2k), k = number of derivatives to the acceleration; double integration of an acceleration multiplies them by f^-4.
The band ends (begins) where the noise power summed over the band is at most `ACCELERATION_NOISE_SHARE` (a hundredth) of
the signal power. On a noisier regressor, least squares would underestimate the mass (errors in variables; see
`motion`).
"""

from collections.abc import Sequence

import numpy as np

from analysis.diagnosis.limits import ACCELERATION_NOISE_SHARE, BAND_NARROWEST_CYCLES, HIGHEST_BAND_END_RATIO
from equalizer.signals.signal import FloatArray
from equalizer.signals.spectral_density import estimate_spectral_density


def compute_band_end_hz(samples: Sequence[FloatArray], rate_hz: float, order: int) -> float:
    """Compute the upper end of the band in Hz: median over recordings and channels, at least `BAND_NARROWEST_CYCLES`
    cycles in the longest recording, at most `HIGHEST_BAND_END_RATIO` of the sample rate. samples: (n, d) each. order:
    time derivative of the position that was measured (0, 1 or 2)."""
    upper_ends_hz = [
        _compute_channel_band_end_hz(column, rate_hz, 2 * (2 - order))
        for recording_samples in samples
        for column in recording_samples.T
    ]
    longest_samples = max(len(recording_samples) for recording_samples in samples)
    return float(
        np.clip(
            np.median(upper_ends_hz),
            BAND_NARROWEST_CYCLES * rate_hz / longest_samples,
            HIGHEST_BAND_END_RATIO * rate_hz,
        )
    )


def compute_band_begin_hz(samples: Sequence[FloatArray], rate_hz: float) -> float:
    """Compute the lower end in Hz of the band in which accelerations are integrated twice: median over recordings and
    channels, at least two cycles in the shortest recording. A channel without a usable line counts with the lowest
    line above 0. samples: accelerations (n, d) each."""
    lower_ends_hz = []
    for column in (column for recording_samples in samples for column in recording_samples.T):
        frequency_hz, density, noise_density = _estimate_signal_and_noise_density(column, rate_hz)
        integration_gain = frequency_hz**-4.0
        signal_power = np.cumsum((np.maximum(density - noise_density, 0.0) * integration_gain)[::-1])[::-1]
        noise_power = np.cumsum((noise_density * integration_gain)[::-1])[::-1]
        usable_lines = np.flatnonzero(noise_power <= ACCELERATION_NOISE_SHARE * signal_power)
        lower_ends_hz.append(float(frequency_hz[usable_lines[0]]) if len(usable_lines) else float(frequency_hz[0]))
    shortest_samples = min(len(recording_samples) for recording_samples in samples)
    return max(float(np.median(lower_ends_hz)), 2 * rate_hz / shortest_samples)


def _compute_channel_band_end_hz(column: FloatArray, rate_hz: float, exponent: int) -> float:
    """Compute the highest frequency in Hz up to which the noise of a channel (n,) is at most `ACCELERATION_NOISE_SHARE`
    of its signal power, both weighted by f^exponent; the lowest line above 0 where there is none."""
    detrended = column - np.linspace(column[0], column[-1], len(column))
    frequency_hz, density, noise_density = _estimate_signal_and_noise_density(detrended, rate_hz)
    signal_power = np.cumsum(np.maximum(density - noise_density, 0.0) * frequency_hz**exponent)
    noise_power = np.cumsum(noise_density * frequency_hz**exponent)
    usable_lines = np.flatnonzero(noise_power <= ACCELERATION_NOISE_SHARE * signal_power)
    return float(frequency_hz[usable_lines[-1]] if len(usable_lines) else frequency_hz[0])


def _estimate_signal_and_noise_density(column: FloatArray, rate_hz: float) -> tuple[FloatArray, FloatArray, float]:
    """Estimate the spectral density of a channel (n,) from segments of at most 4096 samples (chosen). Returns the
    frequencies (lines,) above 0 in Hz, the density (lines,) there in squared units per Hz, and that of its white noise:
    the median over the upper quarter of the lines."""
    frequency_hz, density = estimate_spectral_density(column, rate_hz, 4096)
    return frequency_hz[1:], density[1:], float(np.median(density[1 + 3 * (len(density) - 1) // 4 :]))
