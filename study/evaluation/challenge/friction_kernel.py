"""Dry friction as a relaxed bristle, compiled: one step on one axis."""

from math import exp

from numba import njit

from equalizer.signals.signal import FloatArray

POSITIVE, NEGATIVE, STATIC_RATIO, SPEED, STIFFNESS, SLOPE, BEND = range(7)
"""Columns of an axis's friction: N while moving forwards, N while moving backwards, static over moving level, m/s at
which that excess has fallen to 1/e, N/m of the bristle; 1/m and 1/m^2 by which the level changes along the way."""


@njit(cache=True, nogil=True)
def bristle_force(row: FloatArray, x: float, v: float, bend: float, step_s: float) -> tuple[float, float]:
    """The force on the handle (N) and the bristle's new bend (m).

    The bend follows the motion and relaxes towards level / stiffness. Implicit in the relaxation, so that a stiff
    bristle cannot swing from step to step.
    """
    level = row[POSITIVE] if v > 0.0 else row[NEGATIVE]
    level *= 1.0 + (row[SLOPE] + row[BEND] * x) * x
    if level <= 0.0:
        return 0.0, 0.0
    if row[STATIC_RATIO] > 1.0:
        level *= 1.0 + (row[STATIC_RATIO] - 1.0) * exp(-((v / row[SPEED]) ** 2))
    bend = (bend + step_s * v) / (1.0 + step_s * abs(v) * row[STIFFNESS] / level)
    return -row[STIFFNESS] * bend, bend
