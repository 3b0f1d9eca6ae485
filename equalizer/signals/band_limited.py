"""Zero-phase low-pass filtering of finite records in the frequency domain.

The gain 1 / (1 + (f / f_b)^(2 n)), n = `LOW_PASS_ORDER`, is that of a Butterworth low pass of order n applied forwards
and backwards (its squared magnitude), with zero phase. Records are extended as odd functions at both ends, which limits
the error there. Called by the diagnosis: its inverse dynamics (`analysis.diagnosis.forces`), force balance and search
for laws.
"""

from collections.abc import Callable

import numpy as np
from scipy.fft import irfft, next_fast_len, rfft, rfftfreq

from equalizer.signals.signal import ComplexArray, FloatArray

LOW_PASS_ORDER = 4
"""Order of the Butterworth low pass, applied forwards and backwards (Gautier, Vandanjon and Pressé 1994)."""

LINES_PER_BLOCK = 8192
"""Number of frequency lines that are filtered at once, to limit the memory. Chosen."""


def compute_low_pass_gain(frequency_hz: FloatArray, band_hz: float) -> FloatArray:
    """Compute the gain of the low pass at each frequency (Hz): 1/2 at band_hz, because each of the two passes halves
    the power there. band_hz: f_b of the module docstring, above zero."""
    return np.asarray(1 / (1 + (frequency_hz / band_hz) ** (2 * LOW_PASS_ORDER)))


def filter_by_gain(
    samples: FloatArray, sample_rate_hz: float, compute_gain: Callable[[FloatArray], ComplexArray | FloatArray]
) -> FloatArray:
    """Filter samples (n, k), without NaN, by the matrices compute_gain(frequency_hz), (lines, r, k); returns (n, r).

    The straight line from the first to the last sample is subtracted first; the rest is extended as an odd function
    beyond both ends, so that samples and slope are continuous there. The line is not added again; a caller that needs
    it adds it.
    """
    extended_samples = extend_as_odd(samples - compute_end_to_end_line(samples))
    spectrum, lines_hz = rfft(extended_samples, axis=0), rfftfreq(len(extended_samples), 1 / sample_rate_hz)
    line_blocks = [
        slice(first_line, first_line + LINES_PER_BLOCK) for first_line in range(0, len(lines_hz), LINES_PER_BLOCK)
    ]
    filtered = np.concatenate(
        [np.einsum("lrk,lk->lr", compute_gain(lines_hz[block]), spectrum[block]) for block in line_blocks]
    )
    return np.asarray(irfft(filtered, len(extended_samples), axis=0)[: len(samples)])


def extend_as_odd(samples: FloatArray) -> FloatArray:
    """Extend samples (n, k) as an odd function at both ends; returns a period of it, (at least 2 n - 2, k). Zeros in
    the middle of the extension, far from both ends, pad it to a length with small prime factors: with a large prime
    factor the FFT takes twenty times as long."""
    mirrored = -samples[-2:0:-1]
    exact_length, half_length = len(samples) + len(mirrored), len(mirrored) // 2
    zeros = np.zeros((next_fast_len(exact_length, real=True) - exact_length, samples.shape[1]))
    return np.concatenate([samples, mirrored[:half_length], zeros, mirrored[half_length:]])


def compute_end_to_end_line(samples: FloatArray) -> FloatArray:
    """Compute the straight line (n, k) from the first to the last sample of each channel. samples: (n, k)."""
    relative_time = np.linspace(0.0, 1.0, len(samples))[:, None]
    return np.asarray((1 - relative_time) * samples[0] + relative_time * samples[-1])


def filter_spectrum(
    samples: FloatArray, compute_gain: Callable[[int], FloatArray], subtract_line: bool = True
) -> FloatArray:
    """Filter samples (n, k) in the frequency domain. compute_gain: function of the number of samples of a spectrum that
    returns the frequency response at its lines, (lines,). Samples are continued beyond both ends by an odd extension.
    subtract_line: whether the line between the end points is subtracted before and added after filtering."""
    end_line = compute_end_to_end_line(samples) if subtract_line else np.zeros_like(samples)
    extended = extend_as_odd(samples - end_line)
    spectrum = rfft(extended, axis=0)
    filtered = irfft(compute_gain(len(extended))[:, None] * spectrum, len(extended), axis=0)
    return np.asarray(filtered[: len(samples)] + end_line)


def filter_low_pass(samples: FloatArray, sample_rate_hz: float, band_hz: float, delay_s: float = 0.0) -> FloatArray:
    """Filter samples (n, k) by the low pass, with gain 1/2 at band_hz, and delay them by delay_s seconds. Missing
    samples (NaN) are not allowed and are not detected."""

    def compute_gain(frequency_hz: FloatArray) -> ComplexArray:
        """(lines, k, k): gain and delay, the same for all channels."""
        scalar_gain = compute_low_pass_gain(frequency_hz, band_hz) * np.exp(-2j * np.pi * frequency_hz * delay_s)
        return np.asarray(scalar_gain[:, None, None] * np.eye(samples.shape[1]))

    end_to_end_line = compute_end_to_end_line(samples)
    slope = (samples[-1] - samples[0]) / max(len(samples) - 1, 1) * sample_rate_hz
    return np.asarray(end_to_end_line - slope * delay_s + filter_by_gain(samples, sample_rate_hz, compute_gain))
