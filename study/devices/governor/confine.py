"""Limits the norm of a force to a cap within a tick, with its direction unchanged: F <- F min(1, cap / |F|).

A force that is not finite becomes zero. The functions are compiled into the safety layer's tick (`govern`).
"""

import math

from equalizer.signals.signal import FloatArray
from study.devices.governor.compiling import njit_inline

OVERFLOWING = 1e100
"""Component or norm (N) from which squares of components may overflow; such a force becomes zero."""

LIMIT_FACTOR, EXCESS_FACTOR = 1 - 1e-12, 1 + 1e-9
"""Factors on a limit. Forces are limited to LIMIT_FACTOR times the limit, so that rounding cannot exceed it. A force
counts as limited only beyond EXCESS_FACTOR times the limit, so that a stimulus exactly at its cap does not count."""


@njit_inline
def norm_of(x: float, y: float, z: float) -> float:
    """Euclidean norm of the vector (x, y, z)."""
    return math.sqrt(x * x + y * y + z * z)


@njit_inline
def is_bounded(vector: FloatArray, bound: float) -> bool:
    """Whether all three components are smaller than the bound in magnitude; False for NaN and infinity."""
    return bool(abs(vector[0]) < bound and abs(vector[1]) < bound and abs(vector[2]) < bound)


@njit_inline
def clear(force: FloatArray) -> None:
    """Set a force (3,) to zero."""
    for i in range(3):
        force[i] = 0.0


@njit_inline
def limiting_factor(norm: float, cap: float) -> float:
    """Factor that limits a force of this norm (N) to the cap (N): 1 up to the cap, then cap / norm. 0 where either is
    not a number, the cap is not positive, or the norm is not below `OVERFLOWING`."""
    if not (cap > 0.0 and norm < OVERFLOWING):
        return 0.0
    return 1.0 if norm <= cap * LIMIT_FACTOR else cap * LIMIT_FACTOR / norm


@njit_inline
def confine(force: FloatArray, cap: float) -> bool:
    """Limit a force (3,), N, to the cap (N) in place; zero where a component is not finite or the cap is not positive.
    Returns whether the force exceeded the cap by more than rounding; False where it was not finite."""
    if not (is_bounded(force, OVERFLOWING) and cap > 0.0):
        clear(force)
        return False
    norm = norm_of(force[0], force[1], force[2])
    if norm > cap * LIMIT_FACTOR:
        for i in range(3):
            force[i] *= cap * LIMIT_FACTOR / norm
    return norm > cap * EXCESS_FACTOR
