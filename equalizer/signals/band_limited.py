"""Zero-phase low-pass filtering of finite records in the frequency domain.

The gain 1 / (1 + (f / f_b)^(2 n)), n = `ORDER`, is that of a Butterworth low pass of order n applied forwards and
backwards (its squared magnitude), with zero phase. Records are extended as odd functions at both ends, which limits the
error there.
"""

from collections.abc import Callable

import numpy as np
from scipy.fft import irfft, next_fast_len, rfft, rfftfreq

from equalizer.signals.signal import ComplexArray, FloatArray

ORDER = 4
"""Order of the Butterworth low pass, applied forwards and backwards (Gautier, Vandanjon and Pressé 1994)."""

LINES = 8192
"""Number of frequency lines that are filtered at once, which limits the memory."""


def low_pass_gain(frequency_hz: FloatArray, band_hz: float) -> FloatArray:
    """Gain of the low pass at each frequency (Hz): 1/2 at band_hz, because each of the two passes halves the power
    there."""
    return np.asarray(1 / (1 + (frequency_hz / band_hz) ** (2 * ORDER)))


def filter_by_gain(
    samples: FloatArray, sample_rate_hz: float, gain: Callable[[FloatArray], ComplexArray | FloatArray]
) -> FloatArray:
    """Filter samples (n, k), without NaN, by the matrices gain(frequency_hz), (lines, r, k); returns (n, r).

    The straight line from the first to the last sample is subtracted first; the rest is extended as an odd function
    beyond both ends, so that neither steps nor kinks arise there. The line is not added again; where it is wanted, the
    caller adds it.
    """
    extended = odd_extension(samples - end_to_end_line(samples))
    spectrum, lines = rfft(extended, axis=0), rfftfreq(len(extended), 1 / sample_rate_hz)
    # In blocks: the matrices of all lines at once would take a gigabyte for some minutes of samples at 1 kHz.
    line_blocks = [slice(first, first + LINES) for first in range(0, len(lines), LINES)]
    filtered = np.concatenate([np.einsum("lrk,lk->lr", gain(lines[block]), spectrum[block]) for block in line_blocks])
    return np.asarray(irfft(filtered, len(extended), axis=0)[: len(samples)])


def odd_extension(samples: FloatArray) -> FloatArray:
    """A period, (at least 2 n - 2, k), of samples (n, k) that are extended as an odd function at both ends. Zeros in
    the middle of the extension, far from both ends, pad it to a length with small prime factors: with a large prime
    factor the FFT takes twenty times as long."""
    mirrored = -samples[-2:0:-1]
    exact, middle = len(samples) + len(mirrored), len(mirrored) // 2
    zeros = np.zeros((next_fast_len(exact, real=True) - exact, samples.shape[1]))
    return np.concatenate([samples, mirrored[:middle], zeros, mirrored[middle:]])


def end_to_end_line(samples: FloatArray) -> FloatArray:
    """(n, k): the straight line from the first to the last sample of each channel. samples: (n, k)."""
    position = np.linspace(0.0, 1.0, len(samples))[:, None]
    return np.asarray((1 - position) * samples[0] + position * samples[-1])


def filter_low_pass(samples: FloatArray, sample_rate_hz: float, band_hz: float, late_s: float = 0.0) -> FloatArray:
    """Low pass with gain 1/2 at band_hz of samples (n, k), delayed by late_s seconds. Missing samples (NaN) are not
    allowed and are not detected."""

    def gain(frequency_hz: FloatArray) -> ComplexArray:
        scalar = low_pass_gain(frequency_hz, band_hz) * np.exp(-2j * np.pi * frequency_hz * late_s)
        return np.asarray(scalar[:, None, None] * np.eye(samples.shape[1]))

    line = end_to_end_line(samples)
    slope = (samples[-1] - samples[0]) / max(len(samples) - 1, 1) * sample_rate_hz
    return np.asarray(line - slope * late_s + filter_by_gain(samples, sample_rate_hz, gain))
