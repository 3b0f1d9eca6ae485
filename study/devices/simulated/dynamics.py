"""Equations of motion of the simulated device, for a tick of 1 ms. Equations and their reasons:
docs/simulated_omega3.md.

    M (dv/dt, d2r/dt2) = (J^T t + f + f_stop - I_a J^T (dJ/dt) v,  N^T f - K r - C dr/dt)

v: velocity of the handle against the base; r: rocking of the base in the directions N; M: mass matrix (`inertia`); J:
joint speed per handle velocity; t: torques of the cables (`drives`); f: force of hand and handle modes (`handle`).

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
def add_stops(state: FloatArray, parameters: FloatArray, pull: FloatArray) -> None:
    """Add to pull[:3] the force (N) of the end stop, a spring and a damper beyond a sphere about the origin. It damps
    outward motion only, so that its force never points outwards."""
    x, y, z = state[HANDLE_POSITION], state[HANDLE_POSITION + 1], state[HANDLE_POSITION + 2]
    radius = math.sqrt(x * x + y * y + z * z)
    depth = radius - parameters[STOP_RADIUS]
    if depth <= 0.0:
        return
    outwards = (x * state[HANDLE_VELOCITY] + y * state[HANDLE_VELOCITY + 1] + z * state[HANDLE_VELOCITY + 2]) / radius
    stop_force = parameters[STOP_STIFFNESS] * depth + parameters[STOP_DAMPING] * max(outwards, 0.0)
    pull[0] -= stop_force * x / radius
    pull[1] -= stop_force * y / radius
    pull[2] -= stop_force * z / radius


class TickConstants(NamedTuple):
    """Quantities that stay constant during one tick, except `stretch`."""

    command: FloatArray
    """(3,), commanded motor torques, N m."""
    jacobian: FloatArray
    """(3, 3), joint speed per handle velocity at the midpoint, rad/m."""
    inverse_mass: FloatArray
    """(5, 5), inverse of `fill_mass_matrix` at the midpoint, 1/kg."""
    stretch: FloatArray
    """(3,), of the cables, rad; changes at each step."""
    centrifugal: FloatArray
    """(3,), velocity products (centrifugal and Coriolis force) of the arms at the handle, -I_a J^T (dJ/dt) v, N."""


@inlined
def integrate_tick(state: FloatArray, parameters: FloatArray, force_n: FloatArray) -> None:
    """Advance `state` by a tick under a constant command. force_n: (3,), N, the intended force at the handle."""
    constants = _compute_constants(state, parameters, force_n)
    cables, pulls, force, change = np.empty(3), np.empty(HANDLE_MODES), np.empty(3), np.empty(MASS_MATRIX_SIZE)
    for _ in range(SUBSTEPS):
        step_drives(state, parameters, constants.command, constants.jacobian, constants.stretch, cables)
        fill_handle_force(state, parameters, pulls, force)
        _accelerations(state, parameters, constants, cables, force, change)
        for axis in range(3):
            state[HANDLE_VELOCITY + axis] += STEP_S * change[axis]
            state[HANDLE_POSITION + axis] += STEP_S * state[HANDLE_VELOCITY + axis]
        step_cables(state, constants.jacobian, constants.stretch)
        for mode in range(MOUNT_MODES):
            state[MOUNT_SPEED + mode] += STEP_S * change[3 + mode]
            state[MOUNT_DISPLACEMENT + mode] += STEP_S * state[MOUNT_SPEED + mode]
        _convert_to_absolute(parameters, change)
        step_handle_modes(state, parameters, pulls, change)
        step_sensor(state, parameters)


@inlined
def _compute_constants(state: FloatArray, parameters: FloatArray, force_n: FloatArray) -> TickConstants:
    """Quantities of a tick. The torques are J^-T force_n with J at the present position, as of a controller; dJ/dt is
    the difference between the midpoint and the present position over half a tick."""
    angles, midpoint, start_jacobian = np.empty(3), np.empty(3), np.empty((3, 3))
    constants = TickConstants(
        np.empty(3), np.empty((3, 3)), np.empty((MASS_MATRIX_SIZE, MASS_MATRIX_SIZE)), np.empty(3), np.empty(3)
    )
    for axis in range(3):
        midpoint[axis] = state[HANDLE_POSITION + axis] + 0.5 * TICK_S * state[HANDLE_VELOCITY + axis]
    solve_inverse_kinematics(parameters, midpoint, angles, constants.jacobian)
    solve_inverse_kinematics(parameters, state[HANDLE_POSITION : HANDLE_POSITION + 3], angles, start_jacobian)
    solve_transposed(start_jacobian, force_n, constants.command)
    constants.centrifugal[:] = 0.0
    for number in range(3):
        constants.stretch[number] = state[MOTOR_ANGLE + number] - angles[number]
        rate_change = 0.0
        for axis in range(3):
            rate_change += (constants.jacobian[number, axis] - start_jacobian[number, axis]) * state[
                HANDLE_VELOCITY + axis
            ]
        for axis in range(3):
            constants.centrifugal[axis] -= (
                parameters[ARM_INERTIA] * constants.jacobian[number, axis] * rate_change * 2.0 / TICK_S
            )
    fill_mass_matrix(parameters, constants.jacobian, constants.inverse_mass)
    invert_in_place(constants.inverse_mass)
    return constants


@inlined
def _accelerations(
    state: FloatArray,
    parameters: FloatArray,
    constants: TickConstants,
    cables: FloatArray,
    force: FloatArray,
    change: FloatArray,
) -> None:
    """Fill change (5,), m/s²: acceleration of the handle against the base, then of the two rocking modes. cables: (3,),
    N m. force: (3,), N, on the handle."""
    pull = np.empty(MASS_MATRIX_SIZE)
    for axis in range(3):
        pull[axis] = force[axis] + constants.centrifugal[axis]
        for number in range(3):
            pull[axis] += constants.jacobian[number, axis] * cables[number]
    add_stops(state, parameters, pull)
    for mode in range(MOUNT_MODES):
        pull[3 + mode] = -(
            parameters[MOUNT_STIFFNESS + mode] * state[MOUNT_DISPLACEMENT + mode]
            + parameters[MOUNT_DAMPING + mode] * state[MOUNT_SPEED + mode]
        )
        for axis in range(3):
            pull[3 + mode] += parameters[MOUNT_DIRECTION + 3 * mode + axis] * force[axis]
    for row in range(MASS_MATRIX_SIZE):
        total = 0.0
        for column in range(MASS_MATRIX_SIZE):
            total += constants.inverse_mass[row, column] * pull[column]
        change[row] = total


@inlined
def _convert_to_absolute(parameters: FloatArray, change: FloatArray) -> None:
    """Add the base's acceleration to change[:3], which then is the handle's acceleration in the room."""
    for mode in range(MOUNT_MODES):
        for axis in range(3):
            change[axis] += parameters[MOUNT_DIRECTION + 3 * mode + axis] * change[3 + mode]
