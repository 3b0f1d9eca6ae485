"""Dry friction as a relaxed bristle: one integration step on one axis (compiled)."""

from math import exp

from numba import njit

from equalizer.signals.signal import FloatArray

POSITIVE, NEGATIVE, STATIC_RATIO, SPEED, STIFFNESS, SLOPE, BEND = range(7)
"""Columns of an axis: level (N) while moving forwards, level (N) while moving backwards, ratio of static to moving
level, speed at which that excess has fallen to 1/e (m/s), bristle stiffness (N/m), change of the level with position
(1/m and 1/m^2)."""


@njit(cache=True, nogil=True)
def bristle_force(row: FloatArray, x: float, v: float, bend: float, step_s: float) -> tuple[float, float]:
    """Force on the handle (N) and new deflection of the bristle (m).

    The deflection follows the motion and relaxes towards level / stiffness. The relaxation is integrated implicitly, so
    that a stiff bristle does not oscillate from step to step.
    """
    level = row[POSITIVE] if v > 0.0 else row[NEGATIVE]
    level *= 1.0 + (row[SLOPE] + row[BEND] * x) * x
    if level <= 0.0:
        return 0.0, 0.0
    if row[STATIC_RATIO] > 1.0:
        level *= 1.0 + (row[STATIC_RATIO] - 1.0) * exp(-((v / row[SPEED]) ** 2))
    bend = (bend + step_s * v) / (1.0 + step_s * abs(v) * row[STIFFNESS] / level)
    return -row[STIFFNESS] * bend, bend
