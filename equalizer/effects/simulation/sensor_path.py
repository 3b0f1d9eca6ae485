"""What a sensor makes of a true response, by the limits that a model states."""

import numpy as np
from numba import njit, types

from equalizer.signals.signal import FloatArray

_IN = types.Array(types.float64, 2, "A", readonly=True)


@njit(types.void(_IN, types.float64, types.float64[:, ::1]), cache=True, nogil=True)
def one_pole(samples: FloatArray, decay: float, out: FloatArray) -> None:
    """Fills out (n, c). samples: (n, c)"""
    now, share = np.zeros(out.shape[1]), 1 - decay
    for k in range(out.shape[0]):
        for channel in range(out.shape[1]):
            now[channel] = share * samples[k, channel] + decay * now[channel]
            out[k, channel] = now[channel]


def low_passed(response: FloatArray, sample_rate_hz: float, bandwidth_hz: float) -> FloatArray:
    """One pole, discrete: y += (1 - exp(-2 pi f / rate)) (x - y). response: (n, …)"""
    if bandwidth_hz <= 0:
        return response
    decay = float(np.exp(-2 * np.pi * bandwidth_hz / sample_rate_hz))
    passed = np.empty(response.shape)
    one_pole(response.reshape(len(response), -1), decay, passed.reshape(len(passed), -1))
    return passed


def before_low_pass(response: FloatArray, sample_rate_hz: float, bandwidth_hz: float) -> FloatArray:
    """Undoes `low_passed`."""
    if bandwidth_hz <= 0:
        return response
    decay = float(np.exp(-2 * np.pi * bandwidth_hz / sample_rate_hz))
    before = np.array(response, dtype=np.float64)
    before[1:] -= decay * response[:-1]
    return np.asarray(before / (1 - decay))


def within_range(response: FloatArray, limit: float) -> FloatArray:
    return np.clip(response, -limit, limit) if limit > 0 else response
