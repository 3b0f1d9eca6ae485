"""Noise variance of a frequency response estimate, from three sources: the sample variance between periods, the
spectrum of the response at rest, or, where neither exists, the scatter between neighbouring lines.

Spectra are rfft / length; a noise density s is the power per line times that length, so that it does not depend on it.
Called by the estimation of frequency responses, the fit of mechanical models and the diagnosis.
"""

from collections.abc import Sequence

import numpy as np

from equalizer.identification.frequency_response.experiments import select_instrument_signal
from equalizer.signals.recording import Recording
from equalizer.signals.signal import ComplexArray, FloatArray, find_runs
from equalizer.signals.spectral_density import hann

SETTLING_S = 0.5
"""Settling time (s) after the last excitation, before samples count as rest. Chosen by hand."""
_REST_WINDOW_S, _LEAST_REST_WINDOW = 0.5, 8
"""Length of a window at rest (s): lines 2 Hz apart; and its least number of samples, which have the three lines that
`interpolate_rest_density` needs. Chosen by hand."""
_THIRD_DIFFERENCE_GAIN = 20.0
"""Variance of a third difference over that of a line: 1² + 3² + 3² + 1², from its coefficients 1, -3, 3, -1."""


def compute_period_variance(residuals: ComplexArray) -> FloatArray:
    """Compute the noise power of a single period, (lines, outputs): the sample variance over periods. residuals:
    (periods, lines, outputs), at least two periods."""
    deviations = residuals - residuals.mean(axis=0)
    power: FloatArray = np.sum(np.abs(deviations) ** 2, axis=0) / (len(residuals) - 1)
    return power


def estimate_line_scatter(response: ComplexArray) -> FloatArray:
    """Estimate the expected |error|² of each entry, from third differences between neighbouring lines, which are small
    for a smooth curve. response: (lines, ...), evenly spaced. The values at the ends are repeated. NaN everywhere for
    fewer than five lines, which give less than two differences.

    The estimate includes distortion that repeats from period to period (friction in a sweep), and is too large where
    resonances are as narrow as the line spacing.
    """
    if len(response) < 5:
        return np.full(response.shape, np.nan)
    error_power = np.abs(np.diff(response, n=3, axis=0)) ** 2 / _THIRD_DIFFERENCE_GAIN
    padding = [(1, 2)] + [(0, 0)] * (response.ndim - 1)
    padded_power: FloatArray = np.pad(error_power, padding, mode="edge")
    return padded_power


def smooth_over_lines(power: FloatArray, lines: int) -> FloatArray:
    """Smooth power (lines, ...) by a running mean over `lines` lines, an odd number, at most all; at the ends the last
    value is repeated."""
    if not len(power):
        return power
    # Imported here, because importing SciPy's ndimage takes longer than many estimates.
    from scipy.ndimage import uniform_filter1d

    smoothed_power: FloatArray = uniform_filter1d(power, max(1, min(lines, len(power))), axis=0, mode="nearest")
    # A running sum keeps rounding errors of strong lines after these have left the window, and may become negative.
    return np.asarray(np.maximum(smoothed_power, 0.0))


def estimate_rest_density(recordings: Sequence[Recording], frequency_hz: FloatArray) -> FloatArray | None:
    """Estimate the noise power density s(f) of the response at rest, (lines, outputs), such that s / length is the
    noise power per line of a period of that length (samples). recordings: of the same sample rate and outputs;
    frequency_hz: (lines,). None where no pause contains a window (`_REST_WINDOW_S`) without missing samples."""
    window_powers, lines_hz = [], np.empty(0)
    for recording in recordings:
        length = max(_LEAST_REST_WINDOW, round(_REST_WINDOW_S * recording.sample_rate_hz))
        lines_hz = np.arange(1, length // 2) * recording.sample_rate_hz / length
        window_powers += compute_rest_powers(recording, recording.response.samples, length)
    return interpolate_rest_density(np.mean(window_powers, axis=0), lines_hz, frequency_hz) if window_powers else None


def compute_rest_powers(recording: Recording, samples: FloatArray, length: int) -> list[FloatArray]:
    """Compute the power density (length // 2 - 1, channels) of each Hann window of `length` samples at rest, at lines 1
    to length // 2 - 1. samples: (n, channels), of the recording's length. Windows overlap by half; those with missing
    samples are left out."""
    # The mean square of a Hann window is 3/8: scaled to 1, so that the window does not change the noise power.
    window = np.sqrt(8 / 3) * hann(length)[:, None]
    powers = []
    for start, stop in find_rest_intervals(recording, SETTLING_S):
        for window_start in range(start, stop - length + 1, length // 2):
            window_samples = samples[window_start : window_start + length]
            if np.isfinite(window_samples).all():
                spectrum = np.fft.rfft((window_samples - window_samples.mean(axis=0)) * window, axis=0)[1 : length // 2]
                powers.append(np.abs(spectrum) ** 2 / length)
    return powers


def interpolate_rest_density(mean_power: FloatArray, lines_hz: FloatArray, frequency_hz: FloatArray) -> FloatArray:
    """Smooth the mean of `compute_rest_powers` over nine lines and interpolate it at frequency_hz: (lines, channels);
    outside lines_hz the end value. The two lowest lines of `mean_power`, which has at least three, are overwritten in
    place."""
    # Subtracting the mean of a window removes part of the noise of the lowest lines: replaced by the third line's.
    mean_power[:2] = mean_power[2:3]
    smoothed_power = smooth_over_lines(mean_power, 9)  # chosen by hand: 18 Hz for windows of 0.5 s
    return np.stack([np.interp(frequency_hz, lines_hz, channel) for channel in smoothed_power.T], axis=1)


def find_rest_intervals(recording: Recording, settling_s: float) -> list[tuple[int, int]]:
    """Find the intervals of samples (start, stop exclusive) without excitation, after settling_s seconds. The interval
    at the start of a recording counts from sample 0, because recordings begin at rest. Where a later pause is no longer
    than settling_s, start >= stop."""
    idle_runs = find_runs((select_instrument_signal(recording) == 0).all(axis=1))
    settling_samples = round(settling_s * recording.sample_rate_hz)
    return [(start + (settling_samples if start else 0), stop) for start, stop in idle_runs]
