"""Simulated sensors: encoders of finite resolution, and an ADXL335 with noise, range and mounting errors.

The noise comes from a generator with a 64-bit state (SplitMix64: G. L. Steele, D. Lea, C. H. Flood, "Fast splittable
pseudorandom number generators", OOPSLA 2014), turned into normal numbers by Box and Muller's method. Its state is part
of the rig, so that the noise depends on the seed alone. Compiled into `compiled.sense`.
"""

import math
from typing import Any

import numpy as np
import numpy.typing as npt

from equalizer.signals.signal import FloatArray
from study.devices import rig
from study.devices.simulated.inlined import inlined
from study.devices.simulated.layout import (
    ENCODER_STEP,
    FILTERED_ACCELERATION,
    MOTOR_ANGLE,
    SENSOR_MATRIX,
    SENSOR_NOISE,
    SENSOR_RANGE,
    TRUE_ACCELERATION,
)
from study.devices.simulated.linkage import solve_forward_kinematics
from study.devices.simulated.parameters import GRAVITY_MPS2

_STATE_INCREMENT = np.uint64(0x9E3779B97F4A7C15)
"""Increment of the state in SplitMix64; below, the factors and shifts of its output function (the cited paper)."""
_FIRST_FACTOR = np.uint64(0xBF58476D1CE4E5B9)
_SECOND_FACTOR = np.uint64(0x94D049BB133111EB)
_SHIFT_30, _SHIFT_27, _SHIFT_31, _SHIFT_11 = np.uint64(30), np.uint64(27), np.uint64(31), np.uint64(11)
_UNIFORM_SPACING = 2.0**-53
"""Spacing of the uniform numbers: 53 random bits."""


@inlined
def draw_uniform(noise: npt.NDArray[np.uint64]) -> Any:
    """Draw a uniform number in (0, 1]. Advances noise[0], the state of the generator."""
    noise[0] += _STATE_INCREMENT
    output_bits = noise[0]
    output_bits = (output_bits ^ (output_bits >> _SHIFT_30)) * _FIRST_FACTOR
    output_bits = (output_bits ^ (output_bits >> _SHIFT_27)) * _SECOND_FACTOR
    output_bits = output_bits ^ (output_bits >> _SHIFT_31)
    return (np.float64(output_bits >> _SHIFT_11) + 1.0) * _UNIFORM_SPACING


@inlined
def draw_three_normals(noise: npt.NDArray[np.uint64], normals: FloatArray) -> None:
    """Fill normals (3,) with independent standard normal numbers (Box and Muller)."""
    radius = math.sqrt(-2.0 * math.log(draw_uniform(noise)))
    angle = 2.0 * math.pi * draw_uniform(noise)
    normals[0] = radius * math.cos(angle)
    normals[1] = radius * math.sin(angle)
    radius = math.sqrt(-2.0 * math.log(draw_uniform(noise)))
    normals[2] = radius * math.cos(2.0 * math.pi * draw_uniform(noise))


_POSITION, _ACCELERATION, _TRUE_ACCELERATION = rig.POSITION.start, rig.ACCELERATION.start, rig.TRUE_ACCELERATION.start
"""Index of the first number of position, acceleration and true acceleration in a reading."""


@inlined
def read_sensors(state: FloatArray, parameters: FloatArray, noise: npt.NDArray[np.uint64], reading: FloatArray) -> None:
    """Fill reading (READING_SIZE,), laid out as in `study.devices.rig`. Advances `noise`; `state` is not changed. The
    position is the forward kinematics of the motor angles, rounded to whole counts, so it does not show the cables'
    stretch."""
    angles = np.empty(3)
    count_rad = parameters[ENCODER_STEP]
    for drive in range(3):
        angles[drive] = count_rad * math.floor(state[MOTOR_ANGLE + drive] / count_rad + 0.5)
    solve_forward_kinematics(parameters, angles, reading[_POSITION:_ACCELERATION])
    reading[rig.SENSOR_CLIPPED] = _read_accelerometer(
        state, parameters, noise, reading[_ACCELERATION:_TRUE_ACCELERATION]
    )
    for axis in range(3):
        reading[_TRUE_ACCELERATION + axis] = state[TRUE_ACCELERATION + axis]


@inlined
def _read_accelerometer(
    state: FloatArray, parameters: FloatArray, noise: npt.NDArray[np.uint64], channels: FloatArray
) -> float:
    """Fill channels (3,), m/s². The range limits the specific force, which contains gravity; the reading at rest is
    then subtracted. Returns 1 if a channel was at its limit, else 0."""
    draw_three_normals(noise, channels)
    range_mps2 = parameters[SENSOR_RANGE]
    clipped = 0.0
    for axis in range(3):
        matrix_row = SENSOR_MATRIX + 3 * axis
        gravity_mps2 = parameters[matrix_row + 2] * GRAVITY_MPS2
        specific_force = gravity_mps2 + parameters[SENSOR_NOISE + axis] * channels[axis]
        for column in range(3):
            specific_force += parameters[matrix_row + column] * state[FILTERED_ACCELERATION + column]
        if abs(specific_force) >= range_mps2:
            specific_force = math.copysign(range_mps2, specific_force)
            clipped = 1.0
        channels[axis] = specific_force - gravity_mps2
    return clipped
