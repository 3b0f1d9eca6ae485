"""One pole, and hysteresis, of a sensor read at the sample rate, compiled."""

import numpy as np
from numba import njit

from equalizer.signals.signal import FloatArray


@njit(cache=True, nogil=True)
def one_pole(samples: FloatArray, share: float) -> FloatArray:
    """y += share (x - y), from rest. (n, channels)"""
    smoothed = np.zeros(samples.shape)
    for j in range(samples.shape[1]):
        y = 0.0
        for k in range(samples.shape[0]):
            y += share * (samples[k, j] - y)
            smoothed[k, j] = y
    return smoothed


@njit(cache=True, nogil=True)
def lagging(samples: FloatArray, half_width: float) -> FloatArray:
    """What follows its input with play: it moves only once the input has moved by `half_width` the other way."""
    followed = np.zeros(samples.shape)
    for j in range(samples.shape[1]):
        y = 0.0
        for k in range(samples.shape[0]):
            y = min(max(y, samples[k, j] - half_width), samples[k, j] + half_width)
            followed[k, j] = y
    return followed
