"""Noise of a frequency response estimate: from differences between periods, from rest, or from scatter of lines."""

from collections.abc import Sequence

import numpy as np

from equalizer.identification.frequency_response.experiments import instrument_signal
from equalizer.signals.recording import Recording
from equalizer.signals.signal import ComplexArray, FloatArray, runs_of
from equalizer.signals.spectral_density import hann

SETTLING_S = 0.5
"""Settling time after the last excitation, before samples count as rest."""
_REST_WINDOW_S = 0.5
"""Length of a window at rest."""
_THIRD_DIFFERENCE_GAIN = 20.0
"""1² + 3² + 3² + 1²: ratio of the variance of a third difference to that of a line."""


def period_variance(residuals: ComplexArray) -> FloatArray:
    """Noise power of a single period (lines, outputs): sample variance over periods. residuals: (periods, lines,
    outputs), periods >= 2."""
    around = residuals - residuals.mean(axis=0)
    power: FloatArray = np.sum(np.abs(around) ** 2, axis=0) / (len(residuals) - 1)
    return power


def line_scatter(response: ComplexArray) -> FloatArray:
    """Expected |error|² per entry, from third differences between neighbouring lines, which are small for a smooth
    curve.

    Includes distortion that repeats exactly (friction in a sweep). Too large where resonances are as narrow as the line
    spacing. response: (lines, ...). NaN everywhere for less than five lines.
    """
    if len(response) < 5:
        return np.full(response.shape, np.nan)
    third = np.abs(np.diff(response, n=3, axis=0)) ** 2 / _THIRD_DIFFERENCE_GAIN
    padding = [(1, 2)] + [(0, 0)] * (response.ndim - 1)
    padded: FloatArray = np.pad(third, padding, mode="edge")
    return padded


def smooth_over_lines(power: FloatArray, lines: int) -> FloatArray:
    """Running mean over an odd number of lines. power: (lines, ...)."""
    if not len(power):
        return power
    # Imported here: it takes longer than many an estimate.
    from scipy.ndimage import uniform_filter1d

    smooth: FloatArray = uniform_filter1d(power, max(1, min(lines, len(power))), axis=0, mode="nearest")
    # The running sum keeps rounding errors of strong lines that have left it, and may be negative.
    return np.asarray(np.maximum(smooth, 0.0))


def rest_floor(recordings: Sequence[Recording], frequency_hz: FloatArray) -> FloatArray | None:
    """Noise power density of the response at rest, as s(f) with s / length the power per line of a period of that
    length. Returns (lines, outputs), or None without a rest of sufficient length."""
    powers, lines_hz = [], np.empty(0)
    for recording in recordings:
        length = round(_REST_WINDOW_S * recording.sample_rate_hz)
        lines_hz = np.arange(1, length // 2) * recording.sample_rate_hz / length
        powers += rest_powers(recording, recording.response.samples, length)
    return interpolate_rest(np.mean(powers, axis=0), lines_hz, frequency_hz) if powers else None


def rest_powers(recording: Recording, samples: FloatArray, length: int) -> list[FloatArray]:
    """Power density (length // 2 - 1, channels) of each Hann window of samples (n, channels) at rest, without missing
    samples; the windows overlap by half."""
    window = np.sqrt(8 / 3) * hann(length)[:, None]
    powers = []
    for start, stop in rest_intervals(recording, SETTLING_S):
        for at in range(start, stop - length + 1, length // 2):
            part = samples[at : at + length]
            if np.isfinite(part).all():
                spectrum = np.fft.rfft((part - part.mean(axis=0)) * window, axis=0)[1 : length // 2]
                powers.append(np.abs(spectrum) ** 2 / length)
    return powers


def interpolate_rest(mean: FloatArray, lines_hz: FloatArray, frequency_hz: FloatArray) -> FloatArray:
    """(lines, channels): the mean of `rest_powers`, smoothed, at other frequencies."""
    # The lowest lines are left out: subtracting the mean of a window removes part of their noise.
    mean[:2] = mean[2:3]
    smooth = smooth_over_lines(mean, 9)
    return np.stack([np.interp(frequency_hz, lines_hz, channel) for channel in smooth.T], axis=1)


def rest_intervals(recording: Recording, settling_s: float) -> list[tuple[int, int]]:
    """Intervals (start, stop) without excitation, after settling. Recordings begin at rest."""
    rests = runs_of((instrument_signal(recording) == 0).all(axis=1))
    settling = round(settling_s * recording.sample_rate_hz)
    return [(start + (settling if start else 0), stop) for start, stop in rests]
