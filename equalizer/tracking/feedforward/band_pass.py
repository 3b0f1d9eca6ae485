"""Zero-phase band-pass filtering of a finite record, in the frequency domain.

The gain is 1 within the band and has raised-cosine edges outside it, because a sharp edge would ring for seconds.
"""

import numpy as np

from equalizer.signals.signal import FloatArray

LOWER_STOP_RATIO, UPPER_STOP_RATIO = 0.9, 1.06
"""Outer ends of the edges, where the gain is zero, relative to the lower and to the upper limit of the band.
Chosen: narrower edges would ring for longer."""
PADDING_S = 1.0
"""Duration (s) of the zeros appended to the record, so that the end of the filtered record does not wrap around to its
beginning. Chosen."""


def filter_to_band(samples: FloatArray, sample_rate_hz: float, band_hz: tuple[float, float]) -> FloatArray:
    """Filter samples (N, channels) to the band (Hz). The samples must begin and end at zero, because a jump at the ends
    of the zero-padded record rings into it; noise may begin and end anywhere."""
    padded_length = find_padded_length(len(samples), sample_rate_hz)
    spectrum = np.fft.rfft(samples, padded_length, axis=0)
    gain = compute_band_gain(np.asarray(np.fft.rfftfreq(padded_length, 1 / sample_rate_hz), dtype=np.float64), band_hz)
    filtered: FloatArray = np.fft.irfft(spectrum * gain[:, np.newaxis], padded_length, axis=0)[: len(samples)]
    return filtered


def remove_trend(samples: FloatArray) -> FloatArray:
    """Subtract from each channel of samples (N, channels), N >= 1, the straight line through it (least squares), such
    as the offset and the drift of a sensor, which `filter_to_band` would ring with at the ends."""
    position = np.arange(len(samples))[:, np.newaxis] - (len(samples) - 1) / 2
    slope = (position * samples).sum(axis=0) / max((position**2).sum(), 0.5)  # 0.5: that of two samples
    return np.asarray(samples - samples.mean(axis=0) - slope * position)


def compute_band_gain(frequency_hz: FloatArray, band_hz: tuple[float, float]) -> FloatArray:
    """Compute the gain of the band pass, (lines,): 1 in the band, 0 outside its edges. A band from 0 Hz has no lower
    edge."""
    low_hz, high_hz = band_hz
    lower_edge = (
        np.ones_like(frequency_hz)
        if low_hz == 0
        else (frequency_hz / low_hz - LOWER_STOP_RATIO) / (1 - LOWER_STOP_RATIO)
    )
    upper_edge = (UPPER_STOP_RATIO - frequency_hz / high_hz) / (UPPER_STOP_RATIO - 1)
    edge_position = np.clip(np.minimum(lower_edge, upper_edge), 0.0, 1.0)
    return np.asarray(0.5 - 0.5 * np.cos(np.pi * edge_position))


def find_padded_length(sample_count: int, sample_rate_hz: float) -> int:
    """Compute the number of samples of a record of `sample_count` samples after `PADDING_S` of zeros is appended."""
    return sample_count + round(PADDING_S * sample_rate_hz)
