"""Resampling of a response at shifted or scaled times, by windowed-sinc or linear interpolation.

The sinc has a Kaiser window and is tabulated at fractions of a sample; `logger_kernel.interpolate_samples` interpolates
the table linearly. Used by the effects `clock_drift` and `logger_offset`, and to estimate time shifts.
"""

from functools import cache

import numpy as np

from equalizer.effects.simulation.logger_kernel import interpolate_samples
from equalizer.signals.signal import FloatArray

FILTER_TAPS, TABLE_PHASES = 32, 256
"""Length of the interpolation filter in samples, and number of intervals per sample at which it is tabulated.
Chosen."""
KAISER_BETA = 8.0
"""Shape parameter of the Kaiser window: errors below 2e-4 of the amplitude up to 0.42 of the sample rate (tested)."""


def resample_response(
    response: FloatArray, step_samples: float, offset_samples: float, linear_share: float = 0.0
) -> FloatArray:
    """Resample to a response (n, p) whose sample k is the given response (n, p) at the time k step_samples +
    offset_samples, in samples; the first and the last sample are held beyond the ends. linear_share: share (0 to 1) of
    linear interpolation; the rest is band-limited."""
    resampled = np.empty(response.shape)
    interpolate_samples(
        np.ascontiguousarray(response, dtype=np.float64),
        step_samples,
        offset_samples,
        _tabulate_sinc_weights(),
        linear_share,
        resampled,
    )
    return resampled


@cache
def _tabulate_sinc_weights() -> FloatArray:
    """Tabulate the windowed sinc (TABLE_PHASES + 1, FILTER_TAPS) for each fraction of a sample from 0 to 1, rows
    normalised to sum 1."""
    fraction = np.arange(TABLE_PHASES + 1) / TABLE_PHASES
    distance_samples = fraction[:, None] - np.arange(1 - FILTER_TAPS // 2, FILTER_TAPS // 2 + 1)
    window = np.i0(KAISER_BETA * np.sqrt(np.maximum(1 - (distance_samples / (FILTER_TAPS / 2)) ** 2, 0))) / np.i0(
        KAISER_BETA
    )
    weights = np.sinc(distance_samples) * window
    weights /= weights.sum(axis=1, keepdims=True)
    weights.flags.writeable = False
    return np.asarray(weights)
