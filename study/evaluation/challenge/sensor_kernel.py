"""First-order low-pass and play hysteresis of a simulated accelerometer, sample by sample (compiled)."""

import numpy as np
from numba import njit

from equalizer.signals.signal import FloatArray


@njit(cache=True, nogil=True)
def filter_first_order(samples: FloatArray, smoothing_factor: float) -> FloatArray:
    """Apply the first-order low-pass y += smoothing_factor (x - y) per channel, with y = 0 before the first sample;
    returns a new array. samples: (n, channels); smoothing_factor: 1 - exp(-2 pi f_c / sample rate), 0 to 1, for the
    corner frequency f_c."""
    smoothed = np.zeros(samples.shape)
    for j in range(samples.shape[1]):
        state = 0.0
        for k in range(samples.shape[0]):
            state += smoothing_factor * (samples[k, j] - state)
            smoothed[k, j] = state
    return smoothed


@njit(cache=True, nogil=True)
def apply_play_hysteresis(samples: FloatArray, half_width: float) -> FloatArray:
    """Apply a play operator per channel: the output is the previous output, clipped to within `half_width` of the
    input; it is 0 before the first sample. samples: (n, channels); half_width: in their unit."""
    output = np.zeros(samples.shape)
    for j in range(samples.shape[1]):
        state = 0.0
        for k in range(samples.shape[0]):
            state = min(max(state, samples[k, j] - half_width), samples[k, j] + half_width)
            output[k, j] = state
    return output
