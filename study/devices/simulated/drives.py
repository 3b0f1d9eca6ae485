"""Dynamics of the three drives of the simulated device: amplifier, motor with friction, cable. Called by `dynamics` at
each integration step. For each drive:

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
    AMPLIFIER_COEFFICIENT,
    BRISTLE_DEFLECTION,
    CABLE_DAMPING,
    CABLE_STIFFNESS,
    COULOMB_FRICTION,
    DRIVE_DAMPING,
    DRIVE_INERTIA,
    HANDLE_VELOCITY,
    MOTOR_ANGLE,
    MOTOR_SPEED,
    MOTOR_TORQUE,
    PRESLIDING_RANGE,
    STEP_S,
)


@inlined
def bend_bristle(deflection: float, travel: float, largest_deflection: float) -> float:
    """Compute the deflection of the bristle after a `travel` of the motor, both rad: an implicit Euler step of
    dz = dx - |dx| z / z_max (z_max: `largest_deflection`), so that |z| <= z_max for a travel of any size."""
    return (deflection + travel) / (1.0 + abs(travel) / largest_deflection)


@inlined
def step_drives(
    state: FloatArray,
    parameters: FloatArray,
    command: FloatArray,
    jacobian: FloatArray,
    cable_stretch: FloatArray,
    cable_torques: FloatArray,
) -> None:
    """Integrate amplifiers and motors over a step, in `state`. command: (3,), N m. jacobian: (3, 3), joint speed per
    handle velocity, rad/m. cable_stretch: (3,), rad. Fills cable_torques (3,), the torques on the arms, N m."""
    for drive in range(3):
        arm_speed = 0.0
        for axis in range(3):
            arm_speed += jacobian[drive, axis] * state[HANDLE_VELOCITY + axis]
        motor_speed = state[MOTOR_SPEED + drive]
        stretch_rate = motor_speed - arm_speed
        cable_torques[drive] = (
            parameters[CABLE_STIFFNESS + drive] * cable_stretch[drive]
            + parameters[CABLE_DAMPING + drive] * stretch_rate
        )
        state[MOTOR_TORQUE + drive] += parameters[AMPLIFIER_COEFFICIENT] * (
            command[drive] - state[MOTOR_TORQUE + drive]
        )
        deflection = bend_bristle(state[BRISTLE_DEFLECTION + drive], STEP_S * motor_speed, parameters[PRESLIDING_RANGE])
        state[BRISTLE_DEFLECTION + drive] = deflection
        resistance = (
            parameters[COULOMB_FRICTION] * deflection / parameters[PRESLIDING_RANGE]
            + parameters[DRIVE_DAMPING] * motor_speed
        )
        torque = state[MOTOR_TORQUE + drive] - cable_torques[drive] - resistance
        motor_speed += STEP_S * torque / parameters[DRIVE_INERTIA]
        state[MOTOR_SPEED + drive] = motor_speed
        state[MOTOR_ANGLE + drive] += STEP_S * motor_speed


@inlined
def step_cables(state: FloatArray, jacobian: FloatArray, cable_stretch: FloatArray) -> None:
    """Integrate cable_stretch (3,), rad, over a step, in place. Called when motors and handle have their new speeds
    (semi-implicit Euler)."""
    for drive in range(3):
        stretch_rate = state[MOTOR_SPEED + drive]
        for axis in range(3):
            stretch_rate -= jacobian[drive, axis] * state[HANDLE_VELOCITY + axis]
        cable_stretch[drive] += STEP_S * stretch_rate
