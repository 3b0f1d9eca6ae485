"""Dry friction on one axis as a bristle, in an integration step (compiled).

Dahl's model with a level that depends on position x and velocity v:

    dz/dt = v - |v| K z / L,    F = -K z,    L = level (1 + slope x + bend x^2) (1 + (ratio - 1) exp(-(v/speed)^2))

z: deflection of the bristle (m); K: its stiffness (N/m); the last factor is Stribeck's. No friction where L <= 0.
"""

from math import exp

from numba import njit

from equalizer.signals.signal import FloatArray

POSITIVE, NEGATIVE, STATIC_RATIO, SPEED, STIFFNESS, SLOPE, BEND = range(7)
"""Columns of an axis: level (N) for positive velocity, level (N) for negative velocity, ratio of static to moving
level, speed at which the excess of the static level has fallen to 1/e (m/s), stiffness of the bristle (N/m), change of
the level with position (1/m and 1/m^2)."""


@njit(cache=True, nogil=True)
def bristle_force(row: FloatArray, x: float, v: float, bend: float, step_s: float) -> tuple[float, float]:
    """Force on the handle (N) and new deflection of the bristle (m). row: the columns above; x (m), v (m/s); bend: old
    deflection (m).

    The relaxation of the deflection is integrated implicitly, so that a stiff bristle does not oscillate from step to
    step.
    """
    level = row[POSITIVE] if v > 0.0 else row[NEGATIVE]
    level *= 1.0 + (row[SLOPE] + row[BEND] * x) * x
    if level <= 0.0:
        return 0.0, 0.0
    if row[STATIC_RATIO] > 1.0:
        level *= 1.0 + (row[STATIC_RATIO] - 1.0) * exp(-((v / row[SPEED]) ** 2))
    bend = (bend + step_s * v) / (1.0 + step_s * abs(v) * row[STIFFNESS] / level)
    return -row[STIFFNESS] * bend, bend
