"""Dynamics of the handle of the simulated device: hand, handle modes, and acceleration at the place of the sensor.
Called by `dynamics` at each integration step.

    hand     f = -K (x - x_rest) - C dx/dt                 x: position of the platform in the room
    mode j   m_j (d2b_j/dt2 + h_j . a) = -p_j,  p_j = k_j b_j + c_j db_j/dt       exerts +p_j h_j on the platform
    sensor   a + sum_j g_j h_j d2b_j/dt2, then a first-order low pass

a: acceleration of the platform; b_j: displacement of mode j against the platform along the unit vector h_j; g_j: gain
at the sensor. The mass of the hand is part of the platform's (`packing`).
"""

from equalizer.signals.signal import FloatArray
from study.devices.simulated.inlined import inlined
from study.devices.simulated.layout import (
    FILTERED_ACCELERATION,
    HAND_DAMPING,
    HAND_REST,
    HAND_STIFFNESS,
    HANDLE_MODES,
    HANDLE_POSITION,
    HANDLE_VELOCITY,
    MODE_DAMPING,
    MODE_DIRECTION,
    MODE_DISPLACEMENT,
    MODE_GAIN,
    MODE_MASS,
    MODE_SPEED,
    MODE_STIFFNESS,
    MOUNT_DIRECTION,
    MOUNT_DISPLACEMENT,
    MOUNT_MODES,
    MOUNT_SPEED,
    SENSOR_COEFFICIENT,
    STEP_S,
    TRUE_ACCELERATION,
)


@inlined
def fill_handle_force(state: FloatArray, parameters: FloatArray, mode_forces: FloatArray, force: FloatArray) -> None:
    """Fill force (3,), N, of hand and handle modes on the platform, and mode_forces (HANDLE_MODES,), N, the force of
    each mode along its direction."""
    for axis in range(3):
        displacement = state[HANDLE_POSITION + axis] - parameters[HAND_REST + axis]
        speed = state[HANDLE_VELOCITY + axis]
        for mode in range(MOUNT_MODES):
            direction = parameters[MOUNT_DIRECTION + 3 * mode + axis]
            displacement += direction * state[MOUNT_DISPLACEMENT + mode]
            speed += direction * state[MOUNT_SPEED + mode]
        force[axis] = -parameters[HAND_STIFFNESS + axis] * displacement - parameters[HAND_DAMPING + axis] * speed
    for mode in range(HANDLE_MODES):
        mode_forces[mode] = (
            parameters[MODE_STIFFNESS + mode] * state[MODE_DISPLACEMENT + mode]
            + parameters[MODE_DAMPING + mode] * state[MODE_SPEED + mode]
        )
        for axis in range(3):
            force[axis] += mode_forces[mode] * parameters[MODE_DIRECTION + 3 * mode + axis]


@inlined
def step_handle_modes(
    state: FloatArray, parameters: FloatArray, mode_forces: FloatArray, platform_acceleration: FloatArray
) -> None:
    """Integrate the handle modes over a step, and compute the acceleration at the sensor, in `state`. mode_forces:
    from `fill_handle_force`. platform_acceleration: in the room, (3,), m/s²."""
    for axis in range(3):
        state[TRUE_ACCELERATION + axis] = platform_acceleration[axis]
    for mode in range(HANDLE_MODES):
        mode_acceleration = -mode_forces[mode] / parameters[MODE_MASS + mode]
        for axis in range(3):
            mode_acceleration -= parameters[MODE_DIRECTION + 3 * mode + axis] * platform_acceleration[axis]
        state[MODE_SPEED + mode] += STEP_S * mode_acceleration
        state[MODE_DISPLACEMENT + mode] += STEP_S * state[MODE_SPEED + mode]
        for axis in range(3):
            state[TRUE_ACCELERATION + axis] += (
                parameters[MODE_GAIN + mode] * parameters[MODE_DIRECTION + 3 * mode + axis] * mode_acceleration
            )


@inlined
def step_sensor(state: FloatArray, parameters: FloatArray) -> None:
    """Integrate the accelerometer's first-order low pass over a step, on each axis."""
    for axis in range(3):
        state[FILTERED_ACCELERATION + axis] += parameters[SENSOR_COEFFICIENT] * (
            state[TRUE_ACCELERATION + axis] - state[FILTERED_ACCELERATION + axis]
        )
