"""Integrate the equations of motion of the simulated device over a tick of 1 ms. Reasons: docs/simulated_omega3.md.

    M (dv/dt, d2r/dt2) = (J^T t + f + f_stop - I_a J^T (dJ/dt) v,  N^T f - K r - C dr/dt)

v: velocity of the handle against the base (3,); r: rocking of the base in the directions N (2,); M: mass matrix (5, 5)
(`inertia`); J: joint speed per handle velocity; I_a: inertia of an arm; t: torques of the cables (`drives`); f: force
of hand and handle modes (`handle`); f_stop: force of the end stop; K, C: stiffness and damping of the rocking modes.

J and M are computed once per tick, at the predicted midpoint of the handle's path. The fast parts (cables, handle,
base, friction) take `SUBSTEPS` steps of semi-implicit Euler, speeds before positions, so that energy stays bounded.
"""

import math
from typing import NamedTuple

import numpy as np

from equalizer.signals.signal import FloatArray
from study.devices.simulated.drives import step_cables, step_drives
from study.devices.simulated.handle import fill_handle_force, step_handle_modes, step_sensor
from study.devices.simulated.inertia import MASS_MATRIX_SIZE, fill_mass_matrix, invert_in_place, solve_transposed
from study.devices.simulated.inlined import inlined
from study.devices.simulated.layout import (
    ARM_INERTIA,
    HANDLE_MODES,
    HANDLE_POSITION,
    HANDLE_VELOCITY,
    MOTOR_ANGLE,
    MOUNT_DAMPING,
    MOUNT_DIRECTION,
    MOUNT_DISPLACEMENT,
    MOUNT_MODES,
    MOUNT_SPEED,
    MOUNT_STIFFNESS,
    STEP_S,
    STOP_DAMPING,
    STOP_RADIUS,
    STOP_STIFFNESS,
    SUBSTEPS,
    TICK_S,
)
from study.devices.simulated.linkage import solve_inverse_kinematics


@inlined
def _add_stop_force(state: FloatArray, parameters: FloatArray, generalised_force: FloatArray) -> None:
    """Add the force (N) of the end stop to generalised_force[:3]: a spring and a damper beyond a sphere about the
    origin. The damper acts on outward motion only, so that the force never points outwards."""
    x, y, z = state[HANDLE_POSITION], state[HANDLE_POSITION + 1], state[HANDLE_POSITION + 2]
    radius = math.sqrt(x * x + y * y + z * z)
    depth = radius - parameters[STOP_RADIUS]
    if depth <= 0.0:
        return
    outward_speed = (
        x * state[HANDLE_VELOCITY] + y * state[HANDLE_VELOCITY + 1] + z * state[HANDLE_VELOCITY + 2]
    ) / radius
    stop_force = parameters[STOP_STIFFNESS] * depth + parameters[STOP_DAMPING] * max(outward_speed, 0.0)
    generalised_force[0] -= stop_force * x / radius
    generalised_force[1] -= stop_force * y / radius
    generalised_force[2] -= stop_force * z / radius


class TickQuantities(NamedTuple):
    """Quantities computed once per tick; `cable_stretch` alone is then updated at each step."""

    command: FloatArray
    """(3,), commanded motor torques, N m."""
    jacobian: FloatArray
    """(3, 3), joint speed per handle velocity at the midpoint, rad/m."""
    inverse_mass: FloatArray
    """(5, 5), inverse of `fill_mass_matrix` at the midpoint, 1/kg."""
    cable_stretch: FloatArray
    """(3,), stretch of the cables: motor angle minus joint angle, rad."""
    centrifugal: FloatArray
    """(3,), centrifugal and Coriolis force of the arms at the handle, -I_a J^T (dJ/dt) v, N."""


@inlined
def integrate_tick(state: FloatArray, parameters: FloatArray, force_n: FloatArray) -> None:
    """Integrate `state` over a tick under a constant command. force_n: (3,), N, the commanded force at the handle.
    state, parameters: flat arrays, see `layout`."""
    quantities = _compute_tick_quantities(state, parameters, force_n)
    cable_torques, mode_forces, force, accelerations = (
        np.empty(3),
        np.empty(HANDLE_MODES),
        np.empty(3),
        np.empty(MASS_MATRIX_SIZE),
    )
    for _ in range(SUBSTEPS):
        step_drives(state, parameters, quantities.command, quantities.jacobian, quantities.cable_stretch, cable_torques)
        fill_handle_force(state, parameters, mode_forces, force)
        _compute_accelerations(state, parameters, quantities, cable_torques, force, accelerations)
        for axis in range(3):
            state[HANDLE_VELOCITY + axis] += STEP_S * accelerations[axis]
            state[HANDLE_POSITION + axis] += STEP_S * state[HANDLE_VELOCITY + axis]
        step_cables(state, quantities.jacobian, quantities.cable_stretch)
        for mode in range(MOUNT_MODES):
            state[MOUNT_SPEED + mode] += STEP_S * accelerations[3 + mode]
            state[MOUNT_DISPLACEMENT + mode] += STEP_S * state[MOUNT_SPEED + mode]
        _convert_to_absolute(parameters, accelerations)
        step_handle_modes(state, parameters, mode_forces, accelerations)
        step_sensor(state, parameters)


@inlined
def _compute_tick_quantities(state: FloatArray, parameters: FloatArray, force_n: FloatArray) -> TickQuantities:
    """Compute the quantities of a tick. The commanded torques are J^-T force_n with J at the start position, as a
    controller computes them; dJ/dt is the difference of J between midpoint and start, divided by half a tick."""
    angles, midpoint, start_jacobian = np.empty(3), np.empty(3), np.empty((3, 3))
    quantities = TickQuantities(
        np.empty(3), np.empty((3, 3)), np.empty((MASS_MATRIX_SIZE, MASS_MATRIX_SIZE)), np.empty(3), np.empty(3)
    )
    for axis in range(3):
        midpoint[axis] = state[HANDLE_POSITION + axis] + 0.5 * TICK_S * state[HANDLE_VELOCITY + axis]
    solve_inverse_kinematics(parameters, midpoint, angles, quantities.jacobian)
    solve_inverse_kinematics(parameters, state[HANDLE_POSITION : HANDLE_POSITION + 3], angles, start_jacobian)
    solve_transposed(start_jacobian, force_n, quantities.command)
    quantities.centrifugal[:] = 0.0
    for drive in range(3):
        quantities.cable_stretch[drive] = state[MOTOR_ANGLE + drive] - angles[drive]
        joint_speed_change = 0.0
        for axis in range(3):
            joint_speed_change += (quantities.jacobian[drive, axis] - start_jacobian[drive, axis]) * state[
                HANDLE_VELOCITY + axis
            ]
        for axis in range(3):
            quantities.centrifugal[axis] -= (
                parameters[ARM_INERTIA] * quantities.jacobian[drive, axis] * joint_speed_change * 2.0 / TICK_S
            )
    fill_mass_matrix(parameters, quantities.jacobian, quantities.inverse_mass)
    invert_in_place(quantities.inverse_mass)
    return quantities


@inlined
def _compute_accelerations(
    state: FloatArray,
    parameters: FloatArray,
    quantities: TickQuantities,
    cable_torques: FloatArray,
    force: FloatArray,
    accelerations: FloatArray,
) -> None:
    """Fill accelerations (5,), m/s²: of the handle against the base, then of the two rocking modes. cable_torques:
    (3,), N m. force: (3,), N, of hand and handle modes on the handle."""
    generalised_force = np.empty(MASS_MATRIX_SIZE)
    for axis in range(3):
        generalised_force[axis] = force[axis] + quantities.centrifugal[axis]
        for drive in range(3):
            generalised_force[axis] += quantities.jacobian[drive, axis] * cable_torques[drive]
    _add_stop_force(state, parameters, generalised_force)
    for mode in range(MOUNT_MODES):
        generalised_force[3 + mode] = -(
            parameters[MOUNT_STIFFNESS + mode] * state[MOUNT_DISPLACEMENT + mode]
            + parameters[MOUNT_DAMPING + mode] * state[MOUNT_SPEED + mode]
        )
        for axis in range(3):
            generalised_force[3 + mode] += parameters[MOUNT_DIRECTION + 3 * mode + axis] * force[axis]
    for row in range(MASS_MATRIX_SIZE):
        acceleration = 0.0
        for column in range(MASS_MATRIX_SIZE):
            acceleration += quantities.inverse_mass[row, column] * generalised_force[column]
        accelerations[row] = acceleration


@inlined
def _convert_to_absolute(parameters: FloatArray, accelerations: FloatArray) -> None:
    """Add the acceleration of the base to accelerations[:3], which then is that of the handle in the room, m/s²."""
    for mode in range(MOUNT_MODES):
        for axis in range(3):
            accelerations[axis] += parameters[MOUNT_DIRECTION + 3 * mode + axis] * accelerations[3 + mode]
