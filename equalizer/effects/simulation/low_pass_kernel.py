"""One pole over all channels at once, compiled."""

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
