"""Forces on one axis of the handle that depend on its position x and velocity v only (compiled).

    F = c - k2 x^2 - k3 x^3 + A sin(2 pi x / pitch + phase) - (b |v| + d x^2) v - k_s (x - x_s) beyond an end stop x_s

`mechanism_kernel` adds it to the motion at every integration step.
"""

from math import pi, sin

from numba import njit

from equalizer.signals.signal import FloatArray

CONSTANT, SQUARE, CUBE, RIPPLE, PITCH, PHASE, ABOVE, BELOW, STOP, DRAG, DAMPING_SQUARE = range(11)
"""Columns of an axis: constant force c (N); k2 (N/m^2); k3 (N/m^3); amplitude A (N), pitch (m) and phase (rad) of
cogging; upper and lower position (m) at which an end stop begins, and its stiffness k_s (N/m); quadratic damping b
(N s^2/m^2); position-dependent damping d (N s/m^3)."""


@njit(cache=True, nogil=True)
def handle_force(row: FloatArray, x: float, v: float) -> float:
    """Force on the handle, N. row: the columns above; x (m), v (m/s)."""
    force: float = row[CONSTANT] - (row[SQUARE] + row[CUBE] * x) * x * x
    force -= (row[DRAG] * abs(v) + row[DAMPING_SQUARE] * x * x) * v
    if row[RIPPLE] != 0.0:
        force += row[RIPPLE] * sin(2.0 * pi * x / row[PITCH] + row[PHASE])
    if x > row[ABOVE]:
        force -= row[STOP] * (x - row[ABOVE])
    elif x < row[BELOW]:
        force -= row[STOP] * (x - row[BELOW])
    return force
