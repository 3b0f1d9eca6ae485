"""First-order lag and play hysteresis of a sensor at the sample rate (compiled)."""

import numpy as np
from numba import njit

from equalizer.signals.signal import FloatArray


@njit(cache=True, nogil=True)
def one_pole(samples: FloatArray, share: float) -> FloatArray:
    """First-order low-pass y += share (x - y) from rest. samples: (n, channels)."""
    smoothed = np.zeros(samples.shape)
    for j in range(samples.shape[1]):
        y = 0.0
        for k in range(samples.shape[0]):
            y += share * (samples[k, j] - y)
            smoothed[k, j] = y
    return smoothed


@njit(cache=True, nogil=True)
def play_hysteresis(samples: FloatArray, half_width: float) -> FloatArray:
    """Play operator: the output moves only once the input has moved by `half_width` beyond it. samples: (n,
    channels)."""
    followed = np.zeros(samples.shape)
    for j in range(samples.shape[1]):
        y = 0.0
        for k in range(samples.shape[0]):
            y = min(max(y, samples[k, j] - half_width), samples[k, j] + half_width)
            followed[k, j] = y
    return followed
