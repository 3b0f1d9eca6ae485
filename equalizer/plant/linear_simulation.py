"""Linear part of a mechanical model: exact zero-order-hold discretisation by the matrix exponential, and its poles.

M q'' + D q' + K q = B u + P f has the state x = (q, v) and x' = F x + G (u, f), with commands u and forces f at the
ports P. With both held constant over a step T, x[k+1] = A x[k] + H (u, f)[k], where [A H] are the upper rows of
exp([[F, G], [0, 0]] T) (Van Loan, IEEE Trans. Autom. Control 23:395, 1978). SI units.
"""

from dataclasses import dataclass

import numpy as np
from scipy.linalg import expm

from equalizer.plant.mechanical_model import DERIVATIVE_OF_QUANTITY, MechanicalModel
from equalizer.signals.signal import ComplexArray, FloatArray


@dataclass(frozen=True, slots=True, eq=False)
class LinearSteps:
    """Matrices of one step. The state (q, v) has 2n numbers for n coordinates; inputs are the m commands and the forces
    at r ports, both held during the step. There are p responses."""

    step_s: float
    advance: FloatArray
    """(2n, 2n): the state after the step by the state before."""
    by_command: FloatArray
    """(2n, m): the state after the step by the commands."""
    by_axis_force: FloatArray
    """(2n, r): the state after the step by a force of 1 N (torque of 1 N m) at each port."""
    motion: FloatArray
    """(3 r, 2n): first the positions of all ports, then their velocities, then their accelerations, by the state."""
    motion_by_command: FloatArray
    """(3 r, m): direct effect of the commands on them; not zero for accelerations only."""
    motion_by_axis_force: FloatArray
    """(3 r, r): direct effect of the port forces on them."""
    response: FloatArray
    """(p, 2n): the response, in the quantity of the model."""
    response_by_command: FloatArray
    """(p, m): direct effect of the commands on the response; not zero for an acceleration only."""
    response_by_axis_force: FloatArray
    """(p, r): direct effect of the port forces on the response."""
    position: FloatArray
    """(p, 2n): the response's position by the state, independent of the quantity of the model."""


def driven_axes(model: MechanicalModel) -> FloatArray:
    """(n, m): unit vector in the coordinates along which each command drives; 0 for a command that drives nothing."""
    length = np.linalg.norm(model.input, axis=0)
    return np.asarray(model.input / np.where(length > 0, length, 1.0))


def discretise_model(model: MechanicalModel, step_s: float, ports: FloatArray | None = None) -> LinearSteps:
    """Discretise the structure without actuator, sensor and effects, with a step in s. ports: (n, r), the directions in
    the coordinates along which forces act and motion is output; None = the driven axes."""
    n, m = model.coordinates, model.inputs
    axes = driven_axes(model) if ports is None else ports
    input_matrix = np.asarray(np.linalg.solve(model.mass, np.hstack([model.input, axes])), dtype=np.float64)
    restoring = np.hstack([model.stiffness, model.damping])
    from_state = -np.asarray(np.linalg.solve(model.mass, restoring), dtype=np.float64)
    state_count, input_count = 2 * n, m + axes.shape[1]
    generator_matrix = np.zeros((state_count + input_count, state_count + input_count))
    generator_matrix[:n, n:state_count] = np.eye(n)
    generator_matrix[n:state_count, :state_count] = from_state
    generator_matrix[n:state_count, state_count:] = input_matrix
    step_matrices = expm(generator_matrix * step_s)
    derivative_order = DERIVATIVE_OF_QUANTITY[model.quantity]
    response, response_by_input = _output_rows(model.output, derivative_order, from_state, input_matrix)
    motion = [_output_rows(axes.T, derivative, from_state, input_matrix) for derivative in range(3)]
    return LinearSteps(
        step_s=step_s,
        advance=step_matrices[:state_count, :state_count],
        by_command=step_matrices[:state_count, state_count : state_count + m],
        by_axis_force=step_matrices[:state_count, state_count + m :],
        motion=np.vstack([rows for rows, _ in motion]),
        motion_by_command=np.vstack([direct[:, :m] for _, direct in motion]),
        motion_by_axis_force=np.vstack([direct[:, m:] for _, direct in motion]),
        response=response,
        response_by_command=response_by_input[:, :m],
        response_by_axis_force=response_by_input[:, m:],
        position=_output_rows(model.output, 0, from_state, input_matrix)[0],
    )


def _output_rows(
    output: FloatArray, derivative_order: int, from_state: FloatArray, input_matrix: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Rows of the time derivative of an order (0 to 2) of the outputs (p, n) of the coordinates: for the state,
    (p, 2n), and for the inputs, (p, m + r). Only the acceleration depends on the inputs directly."""
    zeros, direct = np.zeros_like(output), np.zeros((len(output), input_matrix.shape[1]))
    if derivative_order == 0:
        return np.hstack([output, zeros]), direct
    if derivative_order == 1:
        return np.hstack([zeros, output]), direct
    return output @ from_state, output @ input_matrix


def free_motion_rates(model: MechanicalModel) -> ComplexArray:
    """(2n,): eigenvalues of the continuous-time state matrix (poles), 1/s; complex ones come in conjugate pairs."""
    n = model.coordinates
    state_matrix = np.block(
        [
            [np.zeros((n, n)), np.eye(n)],
            [-np.linalg.solve(model.mass, model.stiffness), -np.linalg.solve(model.mass, model.damping)],
        ]
    )
    return np.asarray(np.linalg.eigvals(state_matrix), dtype=np.complex128)


def growth_rate(model: MechanicalModel) -> float:
    """Largest real part of the model's poles, 1/s; negative where all free motion decays."""
    return float(free_motion_rates(model).real.max())
