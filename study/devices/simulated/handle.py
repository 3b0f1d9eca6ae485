"""The handle: the hand on it, its bending modes, and the acceleration at the sensor's place on it."""

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
def handle_force(state: FloatArray, parameters: FloatArray, pulls: FloatArray, force: FloatArray) -> None:
    """Fills force (3,), N, on the platform from what is not tied to the base: hand and handle modes; and
    pulls (MODES,), N, the part of each mode."""
    for axis in range(3):
        away = state[RELATIVE + axis] - parameters[HAND_REST + axis]
        speed = state[VELOCITY + axis]
        for mode in range(MOUNTS):
            direction = parameters[MOUNT_DIRECTION + 3 * mode + axis]
            away += direction * state[ROCKING + mode]
            speed += direction * state[ROCKING_SPEED + mode]
        force[axis] = -parameters[HAND_STIFFNESS + axis] * away - parameters[HAND_DAMPING + axis] * speed
    for mode in range(MODES):
        pulls[mode] = (
            parameters[MODE_STIFFNESS + mode] * state[BENDING + mode]
            + parameters[MODE_DAMPING + mode] * state[BENDING_SPEED + mode]
        )
        for axis in range(3):
            force[axis] += pulls[mode] * parameters[MODE_DIRECTION + 3 * mode + axis]


@inlined
def step_bending(state: FloatArray, parameters: FloatArray, pulls: FloatArray, platform: FloatArray) -> None:
    """One step of the handle modes, carried by the platform's acceleration (3, m/s²); leaves in `state` what the
    sensor's place feels."""
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
    """First-order low pass of the accelerometer: one step of each axis."""
    for axis in range(3):
        state[FILTERED + axis] += parameters[SENSOR_POLE] * (state[TRUE + axis] - state[FILTERED + axis])
