"""Normal random numbers from one 64-bit word of state, so that a recording depends on its seed alone.

SplitMix64: G. L. Steele, D. Lea, C. H. Flood, "Fast splittable pseudorandom number generators", OOPSLA 2014.
"""

import math
from typing import Any

import numpy as np
import numpy.typing as npt

from equalizer.signals.signal import FloatArray
from study.devices.simulated.inlined import inlined

_STEP = np.uint64(0x9E3779B97F4A7C15)
_MIX_1 = np.uint64(0xBF58476D1CE4E5B9)
_MIX_2 = np.uint64(0x94D049BB133111EB)
_S30, _S27, _S31, _S11 = np.uint64(30), np.uint64(27), np.uint64(31), np.uint64(11)
_ULP = 2.0**-53


@inlined
def uniform(noise: npt.NDArray[np.uint64]) -> Any:
    """In (0, 1]. Moves noise[0] on."""
    noise[0] += _STEP
    word = noise[0]
    word = (word ^ (word >> _S30)) * _MIX_1
    word = (word ^ (word >> _S27)) * _MIX_2
    word = word ^ (word >> _S31)
    return (np.float64(word >> _S11) + 1.0) * _ULP


@inlined
def three_normals(noise: npt.NDArray[np.uint64], out: FloatArray) -> None:
    """Fills out (3,) with independent standard normal numbers (Box and Muller)."""
    radius = math.sqrt(-2.0 * math.log(uniform(noise)))
    turn = 2.0 * math.pi * uniform(noise)
    out[0] = radius * math.cos(turn)
    out[1] = radius * math.sin(turn)
    radius = math.sqrt(-2.0 * math.log(uniform(noise)))
    out[2] = radius * math.cos(2.0 * math.pi * uniform(noise))
