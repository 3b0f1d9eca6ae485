"""Limits the norm of a force to a cap within a tick, with its direction unchanged: F <- F min(1, cap / |F|).

A force that is not finite becomes zero. The functions are compiled into the safety layer's tick.
"""

import math

from equalizer.signals.signal import FloatArray
from study.devices.governor.compiling import njit_inline

OVERFLOW_FORCE_N = 1e100
"""Component or norm (N) from which a force becomes zero. Chosen: squares of smaller components do not overflow."""

LIMIT_FACTOR, EXCESS_FACTOR = 1 - 1e-12, 1 + 1e-9
"""Factors on a limit, chosen. Forces are limited to LIMIT_FACTOR times the limit, so that rounding cannot exceed it. A
force counts as limited only beyond EXCESS_FACTOR times the limit, so that a stimulus exactly at its cap does not
count."""


@njit_inline
def compute_norm(x: float, y: float, z: float) -> float:
    """Compute the Euclidean norm of the vector (x, y, z)."""
    return math.sqrt(x * x + y * y + z * z)


@njit_inline
def is_bounded(vector: FloatArray, bound: float) -> bool:
    """Whether all three components are smaller than the bound in magnitude; False for NaN and infinity."""
    return bool(abs(vector[0]) < bound and abs(vector[1]) < bound and abs(vector[2]) < bound)


@njit_inline
def clear_force(force: FloatArray) -> None:
    """Set a force (3,) to zero."""
    for i in range(3):
        force[i] = 0.0


@njit_inline
def compute_limiting_factor(norm_n: float, cap_n: float) -> float:
    """Compute the factor that limits a force of this norm (N) to the cap (N): 1 up to the cap, then cap / norm. 0 where
    either is not a number, the cap is not positive, or the norm is not below `OVERFLOW_FORCE_N`."""
    if not (cap_n > 0.0 and norm_n < OVERFLOW_FORCE_N):
        return 0.0
    return 1.0 if norm_n <= cap_n * LIMIT_FACTOR else cap_n * LIMIT_FACTOR / norm_n


@njit_inline
def confine(force: FloatArray, cap_n: float) -> bool:
    """Limit a force (3,), N, to the cap (N) in place; zero where a component is not finite or not below
    `OVERFLOW_FORCE_N`, or the cap is not positive: then returns False. Else returns whether the force exceeded the cap
    by more than rounding."""
    if not (is_bounded(force, OVERFLOW_FORCE_N) and cap_n > 0.0):
        clear_force(force)
        return False
    norm_n = compute_norm(force[0], force[1], force[2])
    if norm_n > cap_n * LIMIT_FACTOR:
        for i in range(3):
            force[i] *= cap_n * LIMIT_FACTOR / norm_n
    return norm_n > cap_n * EXCESS_FACTOR
