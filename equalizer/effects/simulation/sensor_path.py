"""Model of a sensor: first-order low pass (bandwidth), then clipping at the measuring range.

`simulator` applies both to the true response; effects and the diagnosis also apply or invert the low pass alone. It is
discrete at the sample rate f_s and starts from zero, with the bandwidth f:

    y[k] = d y[k-1] + (1 - d) x[k],    d = exp(-2 pi f / f_s)
"""

import numpy as np
from numba import njit, types

from equalizer.signals.signal import FloatArray

_INPUT_MATRIX = types.Array(types.float64, 2, "A", readonly=True)
"""A matrix of any stride that is only read."""


@njit(types.void(_INPUT_MATRIX, types.float64, types.float64[:, ::1]), cache=True, nogil=True)
def filter_one_pole(samples: FloatArray, pole: float, filtered: FloatArray) -> None:
    """Fill filtered (n, c) with the samples (n, c) after a first-order low pass that starts from zero. pole: d, 0 to
    1."""
    state, input_gain = np.zeros(filtered.shape[1]), 1 - pole
    for k in range(filtered.shape[0]):
        for channel in range(filtered.shape[1]):
            state[channel] = input_gain * samples[k, channel] + pole * state[channel]
            filtered[k, channel] = state[channel]


def apply_low_pass(response: FloatArray, sample_rate_hz: float, bandwidth_hz: float) -> FloatArray:
    """Filter the response (n, ...) by the low pass of the module; unchanged where bandwidth_hz is not above 0."""
    if bandwidth_hz <= 0:
        return response
    pole = float(np.exp(-2 * np.pi * bandwidth_hz / sample_rate_hz))
    filtered = np.empty(response.shape)
    filter_one_pole(response.reshape(len(response), -1), pole, filtered.reshape(len(filtered), -1))
    return filtered


def undo_low_pass(response: FloatArray, sample_rate_hz: float, bandwidth_hz: float) -> FloatArray:
    """Invert `apply_low_pass` exactly: x[k] = (y[k] - d y[k-1]) / (1 - d). response: (n, ...); unchanged where
    bandwidth_hz is not above 0."""
    if bandwidth_hz <= 0:
        return response
    pole = float(np.exp(-2 * np.pi * bandwidth_hz / sample_rate_hz))
    unfiltered = np.array(response, dtype=np.float64)
    unfiltered[1:] -= pole * response[:-1]
    return np.asarray(unfiltered / (1 - pole))


def clip_to_range(response: FloatArray, limit: float) -> FloatArray:
    """Limit each element of the response to -limit to limit, in its unit; unchanged where limit is not above 0."""
    return np.clip(response, -limit, limit) if limit > 0 else response
