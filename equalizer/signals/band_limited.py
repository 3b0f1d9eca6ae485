"""Signals without what lies above a band, and their derivatives, without a shift in time."""

from collections.abc import Callable

import numpy as np
from scipy.fft import irfft, next_fast_len, rfft, rfftfreq

from equalizer.signals.lockin import ComplexArray
from equalizer.signals.signal import FloatArray

ORDER = 4
"""Of the low pass: Butterworth's magnitude, as forwards and backwards in time (Gautier, Vandanjon and Pressé 1994)."""

LINES = 8192
"""That are looked at at once."""


def low_pass(frequency_hz: FloatArray, band_hz: float) -> FloatArray:
    """Gain of a filter of the order that is run forwards and backwards; half the power passes each way."""
    return np.asarray(1 / (1 + (frequency_hz / band_hz) ** (2 * ORDER)))


def through(
    samples: FloatArray, sample_rate_hz: float, gain: Callable[[FloatArray], ComplexArray | FloatArray]
) -> FloatArray:
    """Finite samples (n, k) by lines: gain(frequency_hz) is (lines, r, k). Gives (n, r).

    Continued beyond both ends as an odd function, after the straight line between them was taken off: neither steps
    nor kinks arise there. The line itself is not put back.
    """
    whole = odd_continued(samples - straight(samples))
    spectrum, lines = rfft(whole, axis=0), rfftfreq(len(whole), 1 / sample_rate_hz)
    # Matrices of all lines at once would take a gigabyte for some minutes at 1 kHz.
    pieces = [slice(first, first + LINES) for first in range(0, len(lines), LINES)]
    passed = np.concatenate([np.einsum("lrk,lk->lr", gain(lines[piece]), spectrum[piece]) for piece in pieces])
    return np.asarray(irfft(passed, len(whole), axis=0)[: len(samples)])


def odd_continued(samples: FloatArray) -> FloatArray:
    """One period, (> n, k), of samples (n, k) continued beyond both ends as an odd function about them. Zeros half way
    round, as far from both ends as can be, bring it to a length of small factors: a transform of a length with a large
    prime factor takes twenty times as long."""
    mirrored = -samples[-2:0:-1]
    exact, middle = len(samples) + len(mirrored), len(mirrored) // 2
    zeros = np.zeros((next_fast_len(exact, real=True) - exact, samples.shape[1]))
    return np.concatenate([samples, mirrored[:middle], zeros, mirrored[middle:]])


def straight(samples: FloatArray) -> FloatArray:
    """(n, k): the line from the first to the last."""
    along = np.linspace(0.0, 1.0, len(samples))[:, None]
    return np.asarray((1 - along) * samples[0] + along * samples[-1])


def band_limited(samples: FloatArray, sample_rate_hz: float, band_hz: float, late_s: float = 0.0) -> FloatArray:
    """(n, k) finite samples; late_s: seconds by which they come later."""

    def gain(frequency_hz: FloatArray) -> ComplexArray:
        one = low_pass(frequency_hz, band_hz) * np.exp(-2j * np.pi * frequency_hz * late_s)
        return np.asarray(one[:, None, None] * np.eye(samples.shape[1]))

    line = straight(samples)
    slope = (samples[-1] - samples[0]) / max(len(samples) - 1, 1) * sample_rate_hz
    return np.asarray(line - slope * late_s + through(samples, sample_rate_hz, gain))
