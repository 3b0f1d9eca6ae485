"""The three drives: amplifier, motor with friction, and the cable that pulls the arm."""

from equalizer.signals.signal import FloatArray
from study.devices.simulated.friction import bent_bristle
from study.devices.simulated.inlined import inlined
from study.devices.simulated.layout import (
    AMPLIFIER,
    BRISTLE,
    CABLE,
    CABLE_DAMPING,
    DRIVE_DAMPING,
    DRIVE_INERTIA,
    FRICTION,
    MOTOR,
    MOTOR_SPEED,
    PRESLIDING,
    STEP_S,
    TORQUE,
    VELOCITY,
)


@inlined
def step_drives(
    state: FloatArray,
    parameters: FloatArray,
    command: FloatArray,
    jacobian: FloatArray,
    stretch: FloatArray,
    cables: FloatArray,
) -> None:
    """One step of the motors. Fills cables (3,), the torques on the arms, and moves stretch (3,) on."""
    for drive in range(3):
        arm_speed = 0.0
        for axis in range(3):
            arm_speed += jacobian[drive, axis] * state[VELOCITY + axis]
        speed = state[MOTOR_SPEED + drive]
        slip = speed - arm_speed
        stretch[drive] += STEP_S * slip
        cables[drive] = parameters[CABLE + drive] * stretch[drive] + parameters[CABLE_DAMPING + drive] * slip
        state[TORQUE + drive] += parameters[AMPLIFIER] * (command[drive] - state[TORQUE + drive])
        bend = bent_bristle(state[BRISTLE + drive], STEP_S * speed, parameters[PRESLIDING])
        state[BRISTLE + drive] = bend
        resistance = parameters[FRICTION] * bend / parameters[PRESLIDING] + parameters[DRIVE_DAMPING] * speed
        torque = state[TORQUE + drive] - cables[drive] - resistance
        state[MOTOR_SPEED + drive] = speed + STEP_S * torque / parameters[DRIVE_INERTIA]
        state[MOTOR + drive] += STEP_S * speed
