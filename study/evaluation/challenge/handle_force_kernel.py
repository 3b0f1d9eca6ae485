"""Position- and velocity-dependent forces on one axis of the handle at one instant (compiled)."""

from math import pi, sin

from numba import njit

from equalizer.signals.signal import FloatArray

CONSTANT, SQUARE, CUBE, RIPPLE, PITCH, PHASE, ABOVE, BELOW, STOP, DRAG, DAMPING_SQUARE = range(11)
"""Columns of an axis: N; N/m^2; N/m^3; amplitude (N), pitch (m) and phase (rad) of cogging; upper and lower position
(m) at which an end stop begins, and its N/m; N s^2/m^2; N s/m per square metre from the centre."""


@njit(cache=True, nogil=True)
def handle_force(row: FloatArray, x: float, v: float) -> float:
    """Force on the handle, N."""
    force: float = row[CONSTANT] - (row[SQUARE] + row[CUBE] * x) * x * x
    force -= (row[DRAG] * abs(v) + row[DAMPING_SQUARE] * x * x) * v
    if row[RIPPLE] != 0.0:
        force += row[RIPPLE] * sin(2.0 * pi * x / row[PITCH] + row[PHASE])
    if x > row[ABOVE]:
        force -= row[STOP] * (x - row[ABOVE])
    elif x < row[BELOW]:
        force -= row[STOP] * (x - row[BELOW])
    return force
