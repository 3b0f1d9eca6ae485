"""Zero-phase band-pass filtering of a finite record, in the frequency domain.

The gain is 1 within the band and has raised-cosine edges outside it, because a sharp edge would ring for seconds.
"""

import numpy as np

from equalizer.signals.signal import FloatArray

LOW_EDGE, HIGH_EDGE = 0.9, 1.06
"""Outer ends of the edges, where the gain is zero, relative to the lower and to the upper limit of the band."""
QUIET_S = 1.0
"""Duration (s) of the zeros appended to the record, so that the end of the filtered record does not wrap around to its
beginning."""


def band_part(samples: FloatArray, sample_rate_hz: float, band_hz: tuple[float, float]) -> FloatArray:
    """Part of samples (N, channels) within the band (Hz), in their unit. The samples must begin and end at zero, or be
    noise: the record is zero-padded."""
    length = find_padded_length(len(samples), sample_rate_hz)
    lines = np.fft.rfft(samples, length, axis=0)
    share = band_share(np.asarray(np.fft.rfftfreq(length, 1 / sample_rate_hz), dtype=np.float64), band_hz)
    part: FloatArray = np.fft.irfft(lines * share[:, np.newaxis], length, axis=0)[: len(samples)]
    return part


def band_share(frequency_hz: FloatArray, band_hz: tuple[float, float]) -> FloatArray:
    """Gain of the band pass, (lines,): 1 in the band, 0 outside its edges. A band from 0 Hz has no lower edge."""
    low, high = band_hz
    rise = np.ones_like(frequency_hz) if low == 0 else (frequency_hz / low - LOW_EDGE) / (1 - LOW_EDGE)
    fall = (HIGH_EDGE - frequency_hz / high) / (HIGH_EDGE - 1)
    edge_position = np.clip(np.minimum(rise, fall), 0.0, 1.0)
    return np.asarray(0.5 - 0.5 * np.cos(np.pi * edge_position))


def find_padded_length(samples: int, sample_rate_hz: float) -> int:
    """Number of samples after `QUIET_S` of zeros is appended."""
    return samples + round(QUIET_S * sample_rate_hz)
