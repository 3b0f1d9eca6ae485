"""Handle of the simulated device: hand, bending modes, and acceleration at the place of the accelerometer.

    hand     f = -K (x - x_rest) - C dx/dt                 x: position of the platform in the room
    mode j   m_j (d2b_j/dt2 + h_j . a) = -p_j,  p_j = k_j b_j + c_j db_j/dt       exerts +p_j h_j on the platform
    sensor   a + sum_j g_j h_j d2b_j/dt2, then a first-order low pass

a: acceleration of the platform; b_j: displacement of mode j against the platform along the unit vector h_j; g_j: gain
at the sensor. The mass of the hand is part of the platform's (`packing`).
"""

from equalizer.signals.signal import FloatArray
from study.devices.simulated.inlined import inlined
from study.devices.simulated.layout import (
    BENDING,
    BENDING_SPEED,
    FILTERED,
    HAND_DAMPING,
    HAND_REST,
    HAND_STIFFNESS,
    MODE_DAMPING,
    MODE_DIRECTION,
    MODE_GAIN,
    MODE_MASS,
    MODE_STIFFNESS,
    MODES,
    MOUNT_DIRECTION,
    MOUNTS,
    RELATIVE,
    ROCKING,
    ROCKING_SPEED,
    SENSOR_POLE,
    STEP_S,
    TRUE,
    VELOCITY,
)


@inlined
def fill_handle_force(state: FloatArray, parameters: FloatArray, pulls: FloatArray, force: FloatArray) -> None:
    """Fill force (3,), N, of hand and handle modes on the platform, and pulls (MODES,), N, the force of each mode along
    its direction."""
    for axis in range(3):
        displacement = state[RELATIVE + axis] - parameters[HAND_REST + axis]
        speed = state[VELOCITY + axis]
        for mode in range(MOUNTS):
            direction = parameters[MOUNT_DIRECTION + 3 * mode + axis]
            displacement += direction * state[ROCKING + mode]
            speed += direction * state[ROCKING_SPEED + mode]
        force[axis] = -parameters[HAND_STIFFNESS + axis] * displacement - parameters[HAND_DAMPING + axis] * speed
    for mode in range(MODES):
        pulls[mode] = (
            parameters[MODE_STIFFNESS + mode] * state[BENDING + mode]
            + parameters[MODE_DAMPING + mode] * state[BENDING_SPEED + mode]
        )
        for axis in range(3):
            force[axis] += pulls[mode] * parameters[MODE_DIRECTION + 3 * mode + axis]


@inlined
def step_bending(state: FloatArray, parameters: FloatArray, pulls: FloatArray, platform: FloatArray) -> None:
    """One step of the handle modes, and the acceleration at the sensor, in `state`. pulls: from `fill_handle_force`.
    platform: acceleration of the platform in the room, (3,), m/s²."""
    for axis in range(3):
        state[TRUE + axis] = platform[axis]
    for mode in range(MODES):
        change = -pulls[mode] / parameters[MODE_MASS + mode]
        for axis in range(3):
            change -= parameters[MODE_DIRECTION + 3 * mode + axis] * platform[axis]
        state[BENDING_SPEED + mode] += STEP_S * change
        state[BENDING + mode] += STEP_S * state[BENDING_SPEED + mode]
        for axis in range(3):
            state[TRUE + axis] += parameters[MODE_GAIN + mode] * parameters[MODE_DIRECTION + 3 * mode + axis] * change


@inlined
def step_sensor(state: FloatArray, parameters: FloatArray) -> None:
    """One step of the accelerometer's first-order low pass on each axis."""
    for axis in range(3):
        state[FILTERED + axis] += parameters[SENSOR_POLE] * (state[TRUE + axis] - state[FILTERED + axis])
