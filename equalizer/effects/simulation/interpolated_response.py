"""Reads a sampled response at other times, by windowed-sinc or linear interpolation; used for delays and clock drift.

The sinc is windowed by Kaiser's window and tabulated at fractions of a sample; `reading_kernel.resample_at`
interpolates the table linearly."""

from functools import cache

import numpy as np

from equalizer.effects.simulation.reading_kernel import resample_at
from equalizer.signals.signal import FloatArray

TAPS, PHASES = 32, 256
"""Length of the interpolation filter in samples, and number of its tabulated fractions of a sample."""
BETA = 8.0
"""Shape parameter of the Kaiser window: ripple of 1e-4 up to 0.42 of the sample rate."""


def resample_response(response: FloatArray, per_sample: float, offset: float, linear_share: float = 0.0) -> FloatArray:
    """(n, p): response (n, p) with sample k read at the time k per_sample + offset, in samples; the first and the last
    sample are held beyond the ends. linear_share: share (0 to 1) of linear interpolation; the rest is band-limited."""
    read = np.empty(response.shape)
    resample_at(
        np.ascontiguousarray(response, dtype=np.float64), per_sample, offset, _sinc_weights(), linear_share, read
    )
    return read


@cache
def _sinc_weights() -> FloatArray:
    """(phases + 1, taps): windowed sinc for each fraction of a sample from 0 to 1, each row normalised to the sum 1."""
    fraction = np.arange(PHASES + 1) / PHASES
    distance = fraction[:, None] - np.arange(1 - TAPS // 2, TAPS // 2 + 1)
    window = np.i0(BETA * np.sqrt(np.maximum(1 - (distance / (TAPS / 2)) ** 2, 0))) / np.i0(BETA)
    weights = np.sinc(distance) * window
    weights /= weights.sum(axis=1, keepdims=True)
    weights.flags.writeable = False
    return np.asarray(weights)
