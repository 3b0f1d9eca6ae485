"""First-order lag and play hysteresis of a simulated sensor, at the sample rate (compiled); used by `sensor`."""

import numpy as np
from numba import njit

from equalizer.signals.signal import FloatArray


@njit(cache=True, nogil=True)
def one_pole(samples: FloatArray, share: float) -> FloatArray:
    """First-order low-pass y += share (x - y), with y = 0 at the start. samples: (n, channels); share: 0 to 1."""
    smoothed = np.zeros(samples.shape)
    for j in range(samples.shape[1]):
        y = 0.0
        for k in range(samples.shape[0]):
            y += share * (samples[k, j] - y)
            smoothed[k, j] = y
    return smoothed


@njit(cache=True, nogil=True)
def play_hysteresis(samples: FloatArray, half_width: float) -> FloatArray:
    """Play operator: the output stays within `half_width` of the input and moves only when it must; 0 at the start.
    samples: (n, channels)."""
    output = np.zeros(samples.shape)
    for j in range(samples.shape[1]):
        y = 0.0
        for k in range(samples.shape[0]):
            y = min(max(y, samples[k, j] - half_width), samples[k, j] + half_width)
            output[k, j] = y
    return output
