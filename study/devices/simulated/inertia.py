"""Mass matrix of the simulated device on the arm side of the cables, and two small linear solvers.

Platform, handle and arms move on a base that rocks. The motors are on the other side of the cables (`drives`). The
solvers are written out, because every function of a tick is compiled without calls into a library.
"""

from equalizer.signals.signal import FloatArray
from study.devices.simulated.inlined import inlined
from study.devices.simulated.layout import ARM_INERTIA, MOUNT_DIRECTION, MOUNT_MASS, MOUNT_MODES, PLATFORM_MASS

MASS_MATRIX_SIZE = 3 + MOUNT_MODES
"""Number of rows of the mass matrix: three of the handle, then the modes of the mount."""


@inlined
def fill_mass_matrix(parameters: FloatArray, jacobian: FloatArray, mass_matrix: FloatArray) -> None:
    """Fill the mass matrix `mass_matrix` (5, 5), kg, of the velocities (v, r), from the kinetic energy T:
    2 T = (v + N r)^T S (v + N r) + I |J v|² + r^T M r.
    v: handle against the base; r: rocking speeds, N their directions; S: mass that moves with the handle; I: inertia of
    an arm; J: jacobian (3, 3), rad/m; M: modal masses of the base."""
    directions = parameters[MOUNT_DIRECTION : MOUNT_DIRECTION + 3 * MOUNT_MODES].reshape((MOUNT_MODES, 3))
    platform_mass = parameters[PLATFORM_MASS : PLATFORM_MASS + 9].reshape((3, 3))
    for row in range(3):
        for column in range(3):
            jacobian_product = 0.0
            for leg in range(3):
                jacobian_product += jacobian[leg, row] * jacobian[leg, column]
            mass_matrix[row, column] = platform_mass[row, column] + parameters[ARM_INERTIA] * jacobian_product
        for mode in range(MOUNT_MODES):
            coupling_mass = 0.0
            for axis in range(3):
                coupling_mass += platform_mass[row, axis] * directions[mode, axis]
            mass_matrix[row, 3 + mode] = coupling_mass
            mass_matrix[3 + mode, row] = coupling_mass
    for mode in range(MOUNT_MODES):
        for column_mode in range(MOUNT_MODES):
            coupling_mass = 0.0
            for axis in range(3):
                coupling_mass += directions[mode, axis] * mass_matrix[axis, 3 + column_mode]
            mass_matrix[3 + mode, 3 + column_mode] = coupling_mass
        mass_matrix[3 + mode, 3 + mode] += parameters[MOUNT_MASS + mode]


@inlined
def invert_in_place(matrix: FloatArray) -> None:
    """Invert a positive definite matrix (5, 5) in place by Gauss-Jordan elimination, which then needs no pivoting."""
    for pivot in range(MASS_MATRIX_SIZE):
        inverse_pivot = 1.0 / matrix[pivot, pivot]
        matrix[pivot, pivot] = 1.0
        for column in range(MASS_MATRIX_SIZE):
            matrix[pivot, column] *= inverse_pivot
        for row in range(MASS_MATRIX_SIZE):
            if row != pivot:
                factor = matrix[row, pivot]
                matrix[row, pivot] = 0.0
                for column in range(MASS_MATRIX_SIZE):
                    matrix[row, column] -= factor * matrix[pivot, column]


@inlined
def solve_transposed(jacobian: FloatArray, force: FloatArray, torque: FloatArray) -> None:
    """Fill torque (3,), N m, with the solution of jacobian^T torque = force (Cramer's rule). force: (3,), N. c0, c1 and
    c2: cofactors of the Jacobian's first row."""
    j = jacobian
    c0 = j[1, 1] * j[2, 2] - j[1, 2] * j[2, 1]
    c1 = j[1, 2] * j[2, 0] - j[1, 0] * j[2, 2]
    c2 = j[1, 0] * j[2, 1] - j[1, 1] * j[2, 0]
    inverse_determinant = 1.0 / (j[0, 0] * c0 + j[0, 1] * c1 + j[0, 2] * c2)
    torque[0] = inverse_determinant * (force[0] * c0 + force[1] * c1 + force[2] * c2)
    torque[1] = inverse_determinant * (
        force[0] * (j[0, 2] * j[2, 1] - j[0, 1] * j[2, 2])
        + force[1] * (j[0, 0] * j[2, 2] - j[0, 2] * j[2, 0])
        + force[2] * (j[0, 1] * j[2, 0] - j[0, 0] * j[2, 1])
    )
    torque[2] = inverse_determinant * (
        force[0] * (j[0, 1] * j[1, 2] - j[0, 2] * j[1, 1])
        + force[1] * (j[0, 2] * j[1, 0] - j[0, 0] * j[1, 2])
        + force[2] * (j[0, 0] * j[1, 1] - j[0, 1] * j[1, 0])
    )
