"""Force on one axis of the handle that depends on its position x and velocity v only (compiled).

    F = c - k2 x^2 - k3 x^3 + A sin(2 pi x / pitch + phase) - (b |v| + d x^2) v - k_s (x - x_s) beyond an end stop x_s

Without cogging (A = 0) the pitch may be 0; the stops may be at infinity.
"""

from math import pi, sin

from numba import njit

from equalizer.signals.signal import FloatArray

(
    CONSTANT_FORCE,
    SQUARE_STIFFNESS,
    CUBIC_STIFFNESS,
    COGGING_AMPLITUDE,
    COGGING_PITCH,
    COGGING_PHASE,
    UPPER_STOP,
    LOWER_STOP,
    STOP_STIFFNESS,
    QUADRATIC_DAMPING,
    POSITION_DAMPING,
) = range(11)
"""Columns of an axis: constant force c (N); k2 (N/m^2); k3 (N/m^3); amplitude A (N), pitch (m) and phase (rad) of
cogging; positions x_s (m) of the upper and lower end stop, and their common stiffness k_s (N/m); quadratic damping b
(N s^2/m^2); position-dependent damping d (N s/m^3)."""


@njit(cache=True, nogil=True)
def compute_handle_force(parameters: FloatArray, x: float, v: float) -> float:
    """Compute the force on the handle (N). parameters (11,): the columns above; x: position (m); v: velocity (m/s)."""
    force_n: float = (
        parameters[CONSTANT_FORCE] - (parameters[SQUARE_STIFFNESS] + parameters[CUBIC_STIFFNESS] * x) * x * x
    )
    force_n -= (parameters[QUADRATIC_DAMPING] * abs(v) + parameters[POSITION_DAMPING] * x * x) * v
    if parameters[COGGING_AMPLITUDE] != 0.0:
        force_n += parameters[COGGING_AMPLITUDE] * sin(
            2.0 * pi * x / parameters[COGGING_PITCH] + parameters[COGGING_PHASE]
        )
    if x > parameters[UPPER_STOP]:
        force_n -= parameters[STOP_STIFFNESS] * (x - parameters[UPPER_STOP])
    elif x < parameters[LOWER_STOP]:
        force_n -= parameters[STOP_STIFFNESS] * (x - parameters[LOWER_STOP])
    return force_n
