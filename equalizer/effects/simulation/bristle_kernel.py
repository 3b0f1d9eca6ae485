"""Deflection of a Dahl bristle along a measured path, compiled."""

import numpy as np
from numba import njit, types

from equalizer.signals.signal import FloatArray

_PATH = types.Array(types.float64, 1, "A", readonly=True)


@njit(types.float64[::1](_PATH, types.float64), cache=True)
def bristle_bend(position: FloatArray, longest: float) -> FloatArray:
    """(n,): deflection over `longest`, at which the bristle slips (Dahl's equation). position: (n,), any unit."""
    bend = np.zeros(position.shape[0])
    for k in range(1, position.shape[0]):
        travel = (position[k] - position[k - 1]) / longest
        full = np.sign(travel)
        bend[k] = full + (bend[k - 1] - full) * np.exp(-abs(travel))
    return bend
