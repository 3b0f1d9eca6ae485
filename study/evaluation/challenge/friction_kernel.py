"""Dry friction on one axis by Dahl's bristle model, one integration step at a time (compiled).

The friction level L depends on position x and velocity v:

    dz/dt = v - |v| K z / L,    F = -K z,    L = level (1 + a x + b x^2) (1 + (ratio - 1) exp(-(v/speed)^2))

z: deflection of the bristle (m); K: its stiffness (N/m). The last factor is Stribeck's; it applies where ratio > 1.
Where L <= 0 there is no friction and z is reset to 0.

Source: P. R. Dahl, Solid friction damping of mechanical vibrations, AIAA Journal 14(12), 1976, 1675-1682.
"""

from math import exp

from numba import njit

from equalizer.signals.signal import FloatArray

LEVEL_POSITIVE, LEVEL_NEGATIVE, STATIC_RATIO, STRIBECK_SPEED, BRISTLE_STIFFNESS, LEVEL_SLOPE, LEVEL_CURVATURE = range(7)
"""Columns of an axis: level (N) for positive velocity, level (N) for zero and negative velocity, ratio of static to
kinetic level, Stribeck speed at which the excess of the static level has fallen to 1/e (m/s), stiffness K of the
bristle (N/m), change of the level with position: a (1/m) and b (1/m^2)."""


@njit(cache=True, nogil=True)
def step_bristle(parameters: FloatArray, x: float, v: float, deflection_m: float, step_s: float) -> tuple[float, float]:
    """Integrate the bristle over one step of `step_s` (s); returns the friction force on the handle (N) and the new
    deflection (m). parameters (7,): the columns above; x: position (m); v: velocity (m/s); deflection_m: previous one.

    The relaxation of the deflection is integrated implicitly (backward Euler), so that a stiff bristle does not
    oscillate from step to step.
    """
    level_n = parameters[LEVEL_POSITIVE] if v > 0.0 else parameters[LEVEL_NEGATIVE]
    level_n *= 1.0 + (parameters[LEVEL_SLOPE] + parameters[LEVEL_CURVATURE] * x) * x
    if level_n <= 0.0:
        return 0.0, 0.0
    if parameters[STATIC_RATIO] > 1.0:
        level_n *= 1.0 + (parameters[STATIC_RATIO] - 1.0) * exp(-((v / parameters[STRIBECK_SPEED]) ** 2))
    deflection_m = (deflection_m + step_s * v) / (1.0 + step_s * abs(v) * parameters[BRISTLE_STIFFNESS] / level_n)
    return -parameters[BRISTLE_STIFFNESS] * deflection_m, deflection_m
