"""Sensor: first-order low pass and measuring range, applied to the true response.

The low pass is discrete at the sample rate f_s and starts from zero, with the bandwidth f:

    y[k] = d y[k-1] + (1 - d) x[k],    d = exp(-2 pi f / f_s)
"""

import numpy as np
from numba import njit, types

from equalizer.signals.signal import FloatArray

_IN = types.Array(types.float64, 2, "A", readonly=True)


@njit(types.void(_IN, types.float64, types.float64[:, ::1]), cache=True, nogil=True)
def filter_one_pole(samples: FloatArray, decay: float, out: FloatArray) -> None:
    """Fill out (n, c) with samples (n, c) through a first-order low pass, from zero. decay: its pole, 0 to 1."""
    filtered, share = np.zeros(out.shape[1]), 1 - decay
    for k in range(out.shape[0]):
        for channel in range(out.shape[1]):
            filtered[channel] = share * samples[k, channel] + decay * filtered[channel]
            out[k, channel] = filtered[channel]


def low_pass(response: FloatArray, sample_rate_hz: float, bandwidth_hz: float) -> FloatArray:
    """First-order low pass of the response (n, …), equation above, with the bandwidth in Hz; unchanged for 0 Hz."""
    if bandwidth_hz <= 0:
        return response
    decay = float(np.exp(-2 * np.pi * bandwidth_hz / sample_rate_hz))
    filtered = np.empty(response.shape)
    filter_one_pole(response.reshape(len(response), -1), decay, filtered.reshape(len(filtered), -1))
    return filtered


def undo_low_pass(response: FloatArray, sample_rate_hz: float, bandwidth_hz: float) -> FloatArray:
    """The exact inverse of `low_pass`: x[k] = (y[k] - d y[k-1]) / (1 - d)."""
    if bandwidth_hz <= 0:
        return response
    decay = float(np.exp(-2 * np.pi * bandwidth_hz / sample_rate_hz))
    unfiltered = np.array(response, dtype=np.float64)
    unfiltered[1:] -= decay * response[:-1]
    return np.asarray(unfiltered / (1 - decay))


def clip_to_range(response: FloatArray, limit: float) -> FloatArray:
    """The response limited to -limit to limit, element by element; unchanged where limit is not above 0."""
    return np.clip(response, -limit, limit) if limit > 0 else response
