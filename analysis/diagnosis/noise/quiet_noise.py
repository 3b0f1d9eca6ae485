"""Noise of signals where the device is not driven: at rest, or on the spectral lines above the driven band.

At rest, the noise is estimated from windowed spectra, or at high frequencies from third differences, which remove slow
ringing after an excitation. Without rest, the median power of the lines above the driven band is taken, which single
harmonics hardly change, and the noise is assumed to be white.
"""

from dataclasses import dataclass

import numpy as np

from equalizer.identification.frequency_response.experiments import select_instrument_signal
from equalizer.identification.frequency_response.noise_floor import (
    compute_rest_powers,
    find_rest_intervals,
    interpolate_rest_density,
    smooth_over_lines,
)
from equalizer.signals.recording import Recording
from equalizer.signals.signal import FloatArray, find_runs
from equalizer.signals.spectral_density import hann

_LEAST_WINDOW_SAMPLES = 8
"""Least number of samples of a window at rest: recordings at less than 30 Hz have no window. The constants of this
module are chosen by hand, except for those of the third differences."""
_WINDOW_S = 0.25
"""Length of a window at rest (s)."""
_UNDRIVEN_SHARE = 1e-4
"""Share of the strongest smoothed power of the excitation, at or below which nothing is driven."""
_LEAKAGE_RATIO = 1.3
"""Ratio to the highest driven line above which leakage of the windows is negligible."""
_LEAST_LINES = 16
"""Fewest lines above the driven band from which the noise is estimated."""
_DIFFERENCE_GAIN, _DIFFERENCE_LOSS = 20.0, 2.31
"""Third differences (1, -3, 3, -1) of white noise: gain of variance, 1 + 9 + 9 + 1; and factor by which correlation
reduces the degrees of freedom, 1 + 2 (15² + 6² + 1²) / 20²."""


@dataclass(frozen=True, slots=True, eq=False)
class FastNoise:
    """Variance of the noise at rest at high frequencies, scaled as if it were white."""

    variance: FloatArray
    """(windows, channels), in the channel's unit squared."""
    freedom: FloatArray
    """(windows, channels): degrees of freedom of the variance."""


def estimate_fast_rest_noise(recording: Recording, samples: FloatArray) -> FastNoise | None:
    """Estimate the noise from third differences in windows of `_WINDOW_S`, from `_WINDOW_S` after the end of an
    excitation. samples: (n, channels), of the recording. None where there is no such window without gaps, or a window
    has fewer than `_LEAST_WINDOW_SAMPLES` samples."""
    window_samples = round(_WINDOW_S * recording.sample_rate_hz)
    if window_samples < _LEAST_WINDOW_SAMPLES:
        return None
    variances = []
    for start, stop in find_rest_intervals(recording, _WINDOW_S):
        for window_start in range(start, stop - window_samples + 1, window_samples):
            window = samples[window_start : window_start + window_samples]
            if np.isfinite(window).all():
                variances.append(np.mean(np.diff(window, n=3, axis=0) ** 2, axis=0) / _DIFFERENCE_GAIN)
    if not variances:
        return None
    variance: FloatArray = np.array(variances)
    return FastNoise(variance, np.full(variance.shape, (window_samples - 3) / _DIFFERENCE_LOSS))


def estimate_rest_noise(
    recording: Recording, samples: FloatArray, frequency_hz: FloatArray
) -> tuple[FloatArray, float] | None:
    """Estimate the noise at rest: density (lines, channels) at `frequency_hz`, and its degrees of freedom. None without
    a rest of `_WINDOW_S` (or with fewer than `_LEAST_WINDOW_SAMPLES` samples in it), or where a reading is constant at
    rest, because an encoder's steps then hide its noise."""
    window_samples = round(_WINDOW_S * recording.sample_rate_hz)
    if window_samples < _LEAST_WINDOW_SAMPLES:
        return None
    window_powers = compute_rest_powers(recording, samples, window_samples)
    if not window_powers:
        return None
    lines_hz: FloatArray = np.arange(1.0, window_samples // 2) * (recording.sample_rate_hz / window_samples)
    mean_power = np.mean(window_powers, axis=0)
    if not mean_power.any(axis=0).all():
        return None
    density = interpolate_rest_density(mean_power, lines_hz, frequency_hz)
    # Windows overlap by half, and a Hann window correlates neighbouring lines: about half of all lines are independent.
    return density, float(len(window_powers) * window_samples / 2)


def estimate_quiet_band_noise(
    recording: Recording, samples: FloatArray, frequency_hz: FloatArray
) -> tuple[FloatArray, float] | None:
    """Estimate a white density (lines, channels) with the power of the median line above the driven band, and its
    degrees of freedom; None without such a band of at least `_LEAST_LINES` lines, with a constant excitation, or where
    the longest stretch without gaps has fewer than 2 `_LEAST_LINES` samples."""
    excitation = select_instrument_signal(recording)
    start, stop = _find_longest_run(np.hstack([samples, excitation]))
    samples, excitation_run = samples[start:stop], excitation[start:stop]
    if len(samples) < 2 * _LEAST_LINES:
        return None
    n = len(samples)
    # A Hann window has a mean square of 3/8.
    hann_window = np.sqrt(8 / 3) * hann(n)
    lines_hz: FloatArray = np.arange(1.0, n // 2) * (recording.sample_rate_hz / n)
    excitation_power = (
        np.abs(np.fft.rfft((excitation_run - excitation_run.mean(axis=0)) * hann_window[:, None], axis=0)[1 : n // 2])
        ** 2
    )
    # Smoothed over at least 9 lines, or a number of lines of 1/500 of the samples: chosen by hand.
    smoothed_power = smooth_over_lines(excitation_power.sum(axis=1, keepdims=True), max(9, n // 500))[:, 0]
    if smoothed_power.max() == 0:
        return None
    highest_driven_hz = float(lines_hz[np.flatnonzero(smoothed_power > _UNDRIVEN_SHARE * smoothed_power.max())[-1]])
    quiet_lines = np.flatnonzero(lines_hz > _LEAKAGE_RATIO * highest_driven_hz)
    if len(quiet_lines) < _LEAST_LINES:
        return None
    power = np.abs(np.fft.rfft((samples - samples.mean(axis=0)) * hann_window[:, None], axis=0)[1 : n // 2]) ** 2 / n
    # The power of a line is exponentially distributed, with a median of ln 2 times its mean.
    noise_density = np.median(power[quiet_lines], axis=0) / np.log(2)
    return np.tile(noise_density, (len(frequency_hz), 1)), float(len(quiet_lines))


def _find_longest_run(samples: FloatArray) -> tuple[int, int]:
    """Find start and stop of the longest stretch without a gap: edges of a filled gap would add power at all
    frequencies."""
    return max(find_runs(np.asarray(np.isfinite(samples).all(axis=1))), key=lambda run: run[1] - run[0], default=(0, 0))
