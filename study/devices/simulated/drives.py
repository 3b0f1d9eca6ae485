"""The three drives: amplifier, motor with friction, and the cable that pulls the arm.

Friction is Dahl's (P. R. Dahl, "Solid friction damping of mechanical vibrations", AIAA Journal 14(12), 1976): a bristle
that bends as an elastic spring first and slips at the Coulomb level. It is passive, holds without creep, and has no
corner at zero speed where a simulation at a fixed step would chatter.
"""

from equalizer.signals.signal import FloatArray
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
def bent_bristle(bristle: float, travel: float, longest: float) -> float:
    """The bristle's bend after a `travel`, both rad: dz = dx - |dx| z / longest, solved backwards, so |z| <= longest
    for any step."""
    return (bristle + travel) / (1.0 + abs(travel) / longest)


@inlined
def step_drives(
    state: FloatArray,
    parameters: FloatArray,
    command: FloatArray,
    jacobian: FloatArray,
    stretch: FloatArray,
    cables: FloatArray,
) -> None:
    """One step of the motors. Fills cables (3,), the torques on the arms; stretch (3,) of the cables in rad."""
    for drive in range(3):
        arm_speed = 0.0
        for axis in range(3):
            arm_speed += jacobian[drive, axis] * state[VELOCITY + axis]
        speed = state[MOTOR_SPEED + drive]
        slip = speed - arm_speed
        cables[drive] = parameters[CABLE + drive] * stretch[drive] + parameters[CABLE_DAMPING + drive] * slip
        state[TORQUE + drive] += parameters[AMPLIFIER] * (command[drive] - state[TORQUE + drive])
        bend = bent_bristle(state[BRISTLE + drive], STEP_S * speed, parameters[PRESLIDING])
        state[BRISTLE + drive] = bend
        resistance = parameters[FRICTION] * bend / parameters[PRESLIDING] + parameters[DRIVE_DAMPING] * speed
        torque = state[TORQUE + drive] - cables[drive] - resistance
        speed += STEP_S * torque / parameters[DRIVE_INERTIA]
        state[MOTOR_SPEED + drive] = speed
        state[MOTOR + drive] += STEP_S * speed


@inlined
def step_cables(state: FloatArray, jacobian: FloatArray, stretch: FloatArray) -> None:
    """Moves stretch (3,) on, once motors and handle have their new speeds: with older ones the cables would damp."""
    for drive in range(3):
        slip = state[MOTOR_SPEED + drive]
        for axis in range(3):
            slip -= jacobian[drive, axis] * state[VELOCITY + axis]
        stretch[drive] += STEP_S * slip
