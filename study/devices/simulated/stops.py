"""Soft ends of the workspace."""

import math

from equalizer.signals.signal import FloatArray
from study.devices.simulated.inlined import inlined
from study.devices.simulated.layout import RELATIVE, STOP_DAMPING, STOP_RADIUS, STOP_STIFFNESS, VELOCITY


@inlined
def add_stops(state: FloatArray, parameters: FloatArray, pull: FloatArray) -> None:
    """Adds to pull[:3] the force of a spherical cushion. It damps on the way out only, and never sucks."""
    x, y, z = state[RELATIVE], state[RELATIVE + 1], state[RELATIVE + 2]
    radius = math.sqrt(x * x + y * y + z * z)
    depth = radius - parameters[STOP_RADIUS]
    if depth <= 0.0:
        return
    outwards = (x * state[VELOCITY] + y * state[VELOCITY + 1] + z * state[VELOCITY + 2]) / radius
    push = parameters[STOP_STIFFNESS] * depth + parameters[STOP_DAMPING] * max(outwards, 0.0)
    pull[0] -= push * x / radius
    pull[1] -= push * y / radius
    pull[2] -= push * z / radius
