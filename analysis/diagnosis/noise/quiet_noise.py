"""Noise where nothing is driven: at rest, or on the lines above the driven band."""

from dataclasses import dataclass

import numpy as np

from equalizer.identification.frequency_response.experiments import instrument_signal
from equalizer.identification.frequency_response.noise_floor import SETTLING_S, smooth_over_lines
from equalizer.signals.recording import Recording
from equalizer.signals.signal import FloatArray

_LEAST_SAMPLES = 8
"""Least samples of a window: recordings at less than 32 Hz have no window."""
_WINDOW_S = 0.25
"""Length of a window at rest."""
_SILENT = 1e-4
"""Share of the strongest smoothed power of the command below which nothing is driven."""
_CLEAR = 1.3
"""Ratio to the highest driven line above which leakage of the windows is negligible."""
_LEAST_LINES = 16
"""Fewest lines above the driven band from which the noise is estimated."""
_DIFFERENCE_GAIN, _DIFFERENCE_LOSS = 20.0, 2.31
"""Third differences of white noise: gain of variance, and loss of degrees of freedom by correlation."""


@dataclass(frozen=True, slots=True, eq=False)
class FastNoise:
    """Variance of the noise at rest at high frequencies, scaled as if it were white."""

    variance: FloatArray
    """(windows, channels)"""
    freedom: FloatArray
    """(windows, channels)"""


def fast_noise_at_rest(recording: Recording, samples: FloatArray) -> FastNoise | None:
    """Noise from third differences in windows of 0.25 s, beginning 0.25 s after the excitation: third differences
    remove slow ringing. None where there is no such window."""
    length = round(_WINDOW_S * recording.sample_rate_hz)
    if length < _LEAST_SAMPLES:
        return None
    variances = []
    for start, stop in _rest_intervals(recording, _WINDOW_S):
        for at in range(start, stop - length + 1, length):
            stretch = samples[at : at + length]
            if np.isfinite(stretch).all():
                variances.append(np.mean(np.diff(stretch, n=3, axis=0) ** 2, axis=0) / _DIFFERENCE_GAIN)
    if not variances:
        return None
    variance: FloatArray = np.array(variances)
    return FastNoise(variance, np.full(variance.shape, (length - 3) / _DIFFERENCE_LOSS))


def rest_noise(recording: Recording, samples: FloatArray, frequency_hz: FloatArray) -> tuple[FloatArray, float] | None:
    """(lines, channels) density and its degrees of freedom; None without a rest of a quarter of a second, or where a
    reading is constant at rest: an encoder's steps then hide its noise."""
    length = round(_WINDOW_S * recording.sample_rate_hz)
    if length < _LEAST_SAMPLES:
        return None
    hann = np.sqrt(8 / 3) * (0.5 - 0.5 * np.cos(2 * np.pi * np.arange(length) / length))
    powers = []
    for start, stop in _rest_intervals(recording, SETTLING_S):
        for at in range(start, stop - length + 1, length // 2):
            stretch = samples[at : at + length]
            if np.isfinite(stretch).all():
                spectrum = np.fft.rfft((stretch - stretch.mean(axis=0)) * hann[:, None], axis=0)[1 : length // 2]
                powers.append(np.abs(spectrum) ** 2 / length)
    if not powers:
        return None
    lines_hz: FloatArray = np.arange(1.0, length // 2) * (recording.sample_rate_hz / length)
    mean = np.mean(powers, axis=0)
    if not mean.any(axis=0).all():
        return None
    mean[:2] = mean[2:3]
    smooth = smooth_over_lines(mean, 9)
    density = np.stack([np.interp(frequency_hz, lines_hz, channel) for channel in smooth.T], axis=1)
    # Windows overlap by half, and a Hann window correlates neighbouring lines: about half of all lines are independent.
    return density, float(len(powers) * length / 2)


def quiet_band_noise(
    recording: Recording, samples: FloatArray, frequency_hz: FloatArray
) -> tuple[FloatArray, float] | None:
    """White density (lines, channels) with the power of the median line above the driven band, and its degrees of
    freedom; None without such a band. The median excludes the lines of harmonics."""
    instrument = instrument_signal(recording)
    start, stop = _longest_whole(np.hstack([samples, instrument]))
    samples, command = samples[start:stop], instrument[start:stop]
    if len(samples) < 2 * _LEAST_LINES:
        return None
    n = len(samples)
    window = np.sqrt(8 / 3) * (0.5 - 0.5 * np.cos(2 * np.pi * np.arange(n) / n))
    lines_hz: FloatArray = np.arange(1.0, n // 2) * (recording.sample_rate_hz / n)
    driven = np.abs(np.fft.rfft((command - command.mean(axis=0)) * window[:, None], axis=0)[1 : n // 2]) ** 2
    smooth = smooth_over_lines(driven.sum(axis=1, keepdims=True), max(9, n // 500))[:, 0]
    if smooth.max() == 0:
        return None
    highest_hz = float(lines_hz[np.flatnonzero(smooth > _SILENT * smooth.max())[-1]])
    quiet = np.flatnonzero(lines_hz > _CLEAR * highest_hz)
    if len(quiet) < _LEAST_LINES:
        return None
    power = np.abs(np.fft.rfft((samples - samples.mean(axis=0)) * window[:, None], axis=0)[1 : n // 2]) ** 2 / n
    level = np.median(power[quiet], axis=0) / np.log(2)
    return np.tile(level, (len(frequency_hz), 1)), float(len(quiet))


def _longest_whole(samples: FloatArray) -> tuple[int, int]:
    """Start and stop of the longest stretch without a gap: edges of a filled gap would add power at all frequencies."""
    known = np.isfinite(samples).all(axis=1).astype(np.int8)
    edges = np.flatnonzero(np.diff(np.concatenate([[0], known, [0]]))).reshape(-1, 2)
    if not len(edges):
        return 0, 0
    longest = edges[np.argmax(edges[:, 1] - edges[:, 0])]
    return int(longest[0]), int(longest[1])


def _rest_intervals(recording: Recording, settling_s: float) -> list[tuple[int, int]]:
    """Stretches without excitation, after settling. Recordings begin at rest."""
    driven = ~(instrument_signal(recording) == 0).all(axis=1)
    edges = np.flatnonzero(np.diff(np.concatenate([[True], driven, [True]]).astype(np.int8)))
    settling = round(settling_s * recording.sample_rate_hz)
    rests = zip(edges[::2], edges[1::2], strict=True)
    return [(int(start) + (settling if start else 0), int(stop)) for start, stop in rests]
