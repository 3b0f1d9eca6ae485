"""Forces that depend on where the handle is and how fast it moves, compiled: one axis at one instant."""

from math import pi, sin

from numba import njit

from equalizer.signals.signal import FloatArray

CONSTANT, SQUARE, CUBE, RIPPLE, PITCH, PHASE, ABOVE, BELOW, STOP, DRAG, DAMPING_SQUARE = range(11)
"""Columns of an axis: N; N/m^2; N/m^3; N, m and rad of a ripple; m and m where a stop begins on either side, and its
N/m; N s^2/m^2; N s/m for every square metre away from the centre."""


@njit(cache=True, nogil=True)
def handle_force(row: FloatArray, x: float, v: float) -> float:
    """N, on the handle."""
    force: float = row[CONSTANT] - (row[SQUARE] + row[CUBE] * x) * x * x
    force -= (row[DRAG] * abs(v) + row[DAMPING_SQUARE] * x * x) * v
    if row[RIPPLE] != 0.0:
        force += row[RIPPLE] * sin(2.0 * pi * x / row[PITCH] + row[PHASE])
    if x > row[ABOVE]:
        force -= row[STOP] * (x - row[ABOVE])
    elif x < row[BELOW]:
        force -= row[STOP] * (x - row[BELOW])
    return force
