"""Mass matrix of the simulated device on the arm side of the cables, and two small linear solvers.

Platform, handle and arms move on a base that rocks. The motors are on the other side of the cables (`drives`). The
solvers are written out, because every function of a tick is compiled without calls into a library.
"""

from equalizer.signals.signal import FloatArray
from study.devices.simulated.inlined import inlined
from study.devices.simulated.layout import ARM_INERTIA, MOUNT_DIRECTION, MOUNT_MASS, MOUNTS, PLATFORM_MASS

SIZE = 3 + MOUNTS
"""Rows of the mass matrix: three of the handle, then the modes of the mount."""


@inlined
def fill_mass_matrix(parameters: FloatArray, jacobian: FloatArray, mass: FloatArray) -> None:
    """Fill mass (5, 5), kg, of the velocities (v, r), from the kinetic energy T:
    2 T = (v + N r)^T S (v + N r) + I |J v|² + r^T M r.
    v: handle against the base; r: rocking speeds, N their directions; S: mass that moves with the handle; I: inertia of
    an arm; J: jacobian (3, 3), rad/m; M: modal masses of the base."""
    directions = parameters[MOUNT_DIRECTION : MOUNT_DIRECTION + 3 * MOUNTS].reshape((MOUNTS, 3))
    platform_mass = parameters[PLATFORM_MASS : PLATFORM_MASS + 9].reshape((3, 3))
    for row in range(3):
        for column in range(3):
            arms = 0.0
            for number in range(3):
                arms += jacobian[number, row] * jacobian[number, column]
            mass[row, column] = platform_mass[row, column] + parameters[ARM_INERTIA] * arms
        for mode in range(MOUNTS):
            shared = 0.0
            for axis in range(3):
                shared += platform_mass[row, axis] * directions[mode, axis]
            mass[row, 3 + mode] = shared
            mass[3 + mode, row] = shared
    for mode in range(MOUNTS):
        for second_mode in range(MOUNTS):
            shared = 0.0
            for axis in range(3):
                shared += directions[mode, axis] * mass[axis, 3 + second_mode]
            mass[3 + mode, 3 + second_mode] = shared
        mass[3 + mode, 3 + mode] += parameters[MOUNT_MASS + mode]


@inlined
def invert_in_place(matrix: FloatArray) -> None:
    """Invert a positive definite matrix (SIZE, SIZE) by Gauss-Jordan elimination, which then needs no pivoting."""
    for pivot in range(SIZE):
        scale = 1.0 / matrix[pivot, pivot]
        matrix[pivot, pivot] = 1.0
        for column in range(SIZE):
            matrix[pivot, column] *= scale
        for row in range(SIZE):
            if row != pivot:
                factor = matrix[row, pivot]
                matrix[row, pivot] = 0.0
                for column in range(SIZE):
                    matrix[row, column] -= factor * matrix[pivot, column]


@inlined
def solve_transposed(jacobian: FloatArray, force: FloatArray, torque: FloatArray) -> None:
    """Fill torque (3,), N m, with the solution of jacobian^T torque = force (Cramer's rule). force: (3,), N."""
    j = jacobian
    c0 = j[1, 1] * j[2, 2] - j[1, 2] * j[2, 1]
    c1 = j[1, 2] * j[2, 0] - j[1, 0] * j[2, 2]
    c2 = j[1, 0] * j[2, 1] - j[1, 1] * j[2, 0]
    scale = 1.0 / (j[0, 0] * c0 + j[0, 1] * c1 + j[0, 2] * c2)
    torque[0] = scale * (force[0] * c0 + force[1] * c1 + force[2] * c2)
    torque[1] = scale * (
        force[0] * (j[0, 2] * j[2, 1] - j[0, 1] * j[2, 2])
        + force[1] * (j[0, 0] * j[2, 2] - j[0, 2] * j[2, 0])
        + force[2] * (j[0, 1] * j[2, 0] - j[0, 0] * j[2, 1])
    )
    torque[2] = scale * (
        force[0] * (j[0, 1] * j[1, 2] - j[0, 2] * j[1, 1])
        + force[1] * (j[0, 2] * j[1, 0] - j[0, 0] * j[1, 2])
        + force[2] * (j[0, 0] * j[1, 1] - j[0, 1] * j[1, 0])
    )
