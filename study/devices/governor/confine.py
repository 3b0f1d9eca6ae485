"""Forces kept within a cap, inside the tick."""

import math

from equalizer.signals.signal import FloatArray
from study.devices.governor.compiling import part

OVERFLOWING = 1e100
"""Norm (N) above which squares of components may overflow; such a force becomes zero."""

WITHIN, BEYOND = 1 - 1e-12, 1 + 1e-9
"""Forces are confined to the first share of a limit: rounding cannot then carry them over it. They count as limited
from the second share on: a stimulus that is just at its cap is not clipped."""


@part
def norm_of(x: float, y: float, z: float) -> float:
    """Euclidean norm of a vector."""
    return math.sqrt(x * x + y * y + z * z)


@part
def is_bounded(vector: FloatArray, bound: float) -> bool:
    """False for NaN and infinity too."""
    return bool(abs(vector[0]) < bound and abs(vector[1]) < bound and abs(vector[2]) < bound)


@part
def clear(force: FloatArray) -> None:
    """Set a force to zero."""
    for i in range(3):
        force[i] = 0.0


@part
def kept_share(norm: float, cap: float) -> float:
    """Factor that limits a force of this norm to the cap: 1 up to the cap, 0 where either is not a number."""
    if not (cap > 0.0 and norm < OVERFLOWING):
        return 0.0
    return 1.0 if norm <= cap * WITHIN else cap * WITHIN / norm


@part
def confine(force: FloatArray, cap: float) -> bool:
    """Shorten to the cap, direction kept; zero if it is no force at all. Whether it was above the cap."""
    if not (is_bounded(force, OVERFLOWING) and cap > 0.0):
        clear(force)
        return False
    norm = norm_of(force[0], force[1], force[2])
    if norm > cap * WITHIN:
        for i in range(3):
            force[i] *= cap * WITHIN / norm
    return norm > cap * BEYOND
