"""Spectral density by Welch's method: averaged windowed segments (Welch 1967, IEEE Trans. Audio Electroacoust. 15:70).

The results equal those of SciPy's `welch` and `csd` for the same segment length, with their other defaults.
`scipy.signal` is not used because its import takes longer than the computation of most spectra. Called by
identification, the diagnosis and `equalizer.effects`.
"""

import numpy as np

from equalizer.signals.signal import ComplexArray, FloatArray


def estimate_spectral_density(signal: FloatArray, rate_hz: float, length: int) -> tuple[FloatArray, FloatArray]:
    """Estimate the one-sided power spectral density of a signal (n,) or (n, c), in units squared per hertz; returned
    after its frequencies (lines,), Hz.

    length: samples of a segment, at least 2; n where it is longer. The mean of each segment is removed; segments are
    Hann-windowed and overlap by half. Last samples that fill no segment are not used.
    """
    frequency_hz, power = _average_segments(signal, signal, rate_hz, length)
    return frequency_hz, np.asarray(power.real)


def estimate_cross_density(
    first: FloatArray, second: FloatArray, rate_hz: float, length: int
) -> tuple[FloatArray, ComplexArray]:
    """Estimate the one-sided cross-spectral density of two signals of the same shape: the mean of conj(first) * second,
    per hertz; returned after its frequencies (lines,), Hz. rate_hz, length: as in `estimate_spectral_density`."""
    return _average_segments(first, second, rate_hz, length)


def hann(length: int) -> FloatArray:
    """Periodic Hann window, (length,): 0 at the first sample, 1 in the middle."""
    return np.asarray(0.5 - 0.5 * np.cos(2 * np.pi * np.arange(length) / length))


def compute_line_spectra(periods: FloatArray) -> ComplexArray:
    """Compute the spectra (periods, lines, channels) of samples (periods, length, channels): rfft / length, without the
    lines at zero and at half the sample rate. White noise of variance s² has the mean power s² / length per line."""
    length = periods.shape[1]
    return np.asarray(np.fft.rfft(periods, axis=1)[:, 1 : (length + 1) // 2] / length, dtype=np.complex128)


def _average_segments(
    first: FloatArray, second: FloatArray, rate_hz: float, length: int
) -> tuple[FloatArray, ComplexArray]:
    """Average the spectra of windowed segments: returns the frequencies (lines,) and the one-sided density, (lines,) or
    (lines, c)."""
    length = min(length, len(first))
    window = hann(length).reshape(-1, *[1] * (first.ndim - 1))
    starts = range(0, len(first) - length + 1, length - length // 2)
    spectrum_sum = np.zeros((length // 2 + 1, *first.shape[1:]), dtype=np.complex128)
    for start in starts:
        first_spectrum = transform_windowed(first[start : start + length], window)
        spectrum_sum += first_spectrum.conj() * (
            first_spectrum if second is first else transform_windowed(second[start : start + length], window)
        )
    density = spectrum_sum / (len(starts) * rate_hz * float(np.sum(window**2)))
    # One-sided: each line except those at zero and at half the sample rate includes the power at its negative
    # frequency.
    density[1 : len(density) - (length % 2 == 0)] *= 2
    return np.asarray(np.fft.rfftfreq(length, 1 / rate_hz), dtype=np.float64), np.asarray(density)


def transform_windowed(segment: FloatArray, window: FloatArray) -> ComplexArray:
    """Compute the FFT of a segment along its first axis, without its mean and windowed."""
    return np.asarray(np.fft.rfft(window * (segment - segment.mean(axis=0)), axis=0))
