"""The band in which accelerations and positions can be computed from a measured motion, given its white noise.

With the power spectral density S(f) of the motion and the density N of its white noise, differentiation multiplies both
by f^(2k), k = number of derivatives to the acceleration; double integration of an acceleration multiplies them by f^-4.
The band ends (begins) where the noise power summed over the band is at most `ACCELERATION_NOISE_SHARE` (a hundredth) of
the signal power. On a noisier regressor, least squares would underestimate the mass (errors in variables).
"""

from collections.abc import Sequence

import numpy as np

from analysis.diagnosis.settings import ACCELERATION_NOISE_SHARE, BAND_NARROWEST_CYCLES, BAND_WIDEST
from equalizer.signals.signal import FloatArray
from equalizer.signals.spectral_density import spectral_density


def band_end_hz(samples: Sequence[FloatArray], rate_hz: float, order: int) -> float:
    """Upper end of the band in Hz: median over recordings and channels, between limits set by length and sample rate.
    samples: (n, d) each. order: time derivative of the position that was measured (0, 1 or 2)."""
    ends = [
        _end_hz(column, rate_hz, 2 * (2 - order)) for recording_samples in samples for column in recording_samples.T
    ]
    longest = max(len(recording_samples) for recording_samples in samples)
    return float(np.clip(np.median(ends), BAND_NARROWEST_CYCLES * rate_hz / longest, BAND_WIDEST * rate_hz))


def band_begin_hz(samples: Sequence[FloatArray], rate_hz: float) -> float:
    """Lower end in Hz of the band in which accelerations are integrated twice: median over recordings and channels, at
    least two cycles per recording. samples: accelerations (n, d) each."""
    lower_ends_hz = []
    for column in (column for recording_samples in samples for column in recording_samples.T):
        frequency_hz, density, floor = _spectrum(column, rate_hz)
        weight = frequency_hz**-4.0
        signal = np.cumsum((np.maximum(density - floor, 0.0) * weight)[::-1])[::-1]
        noise = np.cumsum((floor * weight)[::-1])[::-1]
        allowed = np.flatnonzero(noise <= ACCELERATION_NOISE_SHARE * signal)
        lower_ends_hz.append(float(frequency_hz[allowed[0]]) if len(allowed) else float(frequency_hz[0]))
    shortest = min(len(recording_samples) for recording_samples in samples)
    return max(float(np.median(lower_ends_hz)), 2 * rate_hz / shortest)


def _end_hz(column: FloatArray, rate_hz: float, power: int) -> float:
    """Highest frequency up to which noise is a small share of the power, both weighted by f^power, of a signal (n,)."""
    flat = column - np.linspace(column[0], column[-1], len(column))
    frequency_hz, density, floor = _spectrum(flat, rate_hz)
    signal = np.cumsum(np.maximum(density - floor, 0.0) * frequency_hz**power)
    noise = np.cumsum(floor * frequency_hz**power)
    allowed = np.flatnonzero(noise <= ACCELERATION_NOISE_SHARE * signal)
    return float(frequency_hz[allowed[-1]] if len(allowed) else frequency_hz[0])


def _spectrum(column: FloatArray, rate_hz: float) -> tuple[FloatArray, FloatArray, float]:
    """Frequencies above zero, the spectral density there, and that of white noise: the median of the upper quarter."""
    frequency_hz, density = spectral_density(column, rate_hz, 4096)
    return frequency_hz[1:], density[1:], float(np.median(density[1 + 3 * (len(density) - 1) // 4 :]))
