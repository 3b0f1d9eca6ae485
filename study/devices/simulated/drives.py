"""The three drives: amplifier, motor with friction, and the cable that pulls the arm. For each drive:

    amplifier   a first-order low pass from the commanded torque to the motor's torque u
    motor       I dw/dt = u - cable - f_C z / z_max - d w               w: speed of the motor, rad/s
    friction    dz/dt = w - |w| z / z_max                               z: deflection of a bristle, rad
    cable       cable = k s + c ds/dt,  ds/dt = w - J v                 s: stretch, rad; J v: speed of the arm, rad/s

Friction is Dahl's (P. R. Dahl, "Solid friction damping of mechanical vibrations", AIAA Journal 14(12), 1976): a bristle
that deflects elastically at first and slips at the Coulomb level f_C. It is passive, holds a constant load without
creep, and is continuous at zero speed, where a discontinuous law would chatter at a fixed step. Integration:
semi-implicit Euler with the step `STEP_S`.
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
def bend_bristle(bristle: float, travel: float, longest: float) -> float:
    """Deflection of the bristle after a `travel` of the motor, both rad: an implicit Euler step of
    dz = dx - |dx| z / longest, so that |z| <= longest for a travel of any size."""
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
    """One step of amplifiers and motors, in `state`. command: (3,), N m. jacobian: (3, 3), joint speed per handle
    velocity, rad/m. stretch: (3,) of the cables, rad. Fills cables (3,), the torques on the arms, N m."""
    for drive in range(3):
        arm_speed = 0.0
        for axis in range(3):
            arm_speed += jacobian[drive, axis] * state[VELOCITY + axis]
        speed = state[MOTOR_SPEED + drive]
        slip = speed - arm_speed
        cables[drive] = parameters[CABLE + drive] * stretch[drive] + parameters[CABLE_DAMPING + drive] * slip
        state[TORQUE + drive] += parameters[AMPLIFIER] * (command[drive] - state[TORQUE + drive])
        bend = bend_bristle(state[BRISTLE + drive], STEP_S * speed, parameters[PRESLIDING])
        state[BRISTLE + drive] = bend
        resistance = parameters[FRICTION] * bend / parameters[PRESLIDING] + parameters[DRIVE_DAMPING] * speed
        torque = state[TORQUE + drive] - cables[drive] - resistance
        speed += STEP_S * torque / parameters[DRIVE_INERTIA]
        state[MOTOR_SPEED + drive] = speed
        state[MOTOR + drive] += STEP_S * speed


@inlined
def step_cables(state: FloatArray, jacobian: FloatArray, stretch: FloatArray) -> None:
    """One step of stretch (3,), rad. Called when motors and handle have their new speeds (semi-implicit Euler)."""
    for drive in range(3):
        slip = state[MOTOR_SPEED + drive]
        for axis in range(3):
            slip -= jacobian[drive, axis] * state[VELOCITY + axis]
        stretch[drive] += STEP_S * slip
