"""What a tick reads: encoders of finite resolution, and an ADXL335 with noise, range and mounting errors."""

import math

import numpy as np
import numpy.typing as npt

from equalizer.signals.signal import FloatArray
from study.devices import rig
from study.devices.simulated.inlined import inlined
from study.devices.simulated.layout import (
    COUNT,
    FILTERED,
    MOTOR,
    SENSOR_MATRIX,
    SENSOR_NOISE,
    SENSOR_RANGE,
    TRUE,
)
from study.devices.simulated.linkage import forward_kinematics
from study.devices.simulated.parameters import GRAVITY_M_S2
from study.devices.simulated.random_numbers import three_normals

_POSITION, _ACCELERATION, _TRUE = rig.POSITION.start, rig.ACCELERATION.start, rig.TRUE_ACCELERATION.start


@inlined
def read_sensors(state: FloatArray, parameters: FloatArray, noise: npt.NDArray[np.uint64], reading: FloatArray) -> None:
    """Fills reading as `study.devices.rig` lays it out. Changes noise only."""
    angles = np.empty(3)
    count = parameters[COUNT]
    for drive in range(3):
        angles[drive] = count * math.floor(state[MOTOR + drive] / count + 0.5)
    forward_kinematics(parameters, angles, reading[_POSITION:_ACCELERATION])
    reading[rig.SENSOR_CLIPPED] = _accelerometer(state, parameters, noise, reading[_ACCELERATION:_TRUE])
    for axis in range(3):
        reading[_TRUE + axis] = state[TRUE + axis]


@inlined
def _accelerometer(
    state: FloatArray, parameters: FloatArray, noise: npt.NDArray[np.uint64], channels: FloatArray
) -> float:
    """The range bounds specific force with gravity in it; what the channels read at rest is then taken off."""
    three_normals(noise, channels)
    limit = parameters[SENSOR_RANGE]
    clipped = 0.0
    for axis in range(3):
        row = SENSOR_MATRIX + 3 * axis
        rest = parameters[row + 2] * GRAVITY_M_S2
        force = rest + parameters[SENSOR_NOISE + axis] * channels[axis]
        for other in range(3):
            force += parameters[row + other] * state[FILTERED + other]
        if abs(force) >= limit:
            force = math.copysign(limit, force)
            clipped = 1.0
        channels[axis] = force - rest
    return clipped
