"""Linear part of a mechanical model: zero-order-hold discretisation for simulations, driven axes, and poles.

M q'' + D q' + K q = B u + P f has the state x = (q, v) and x' = F x + G (u, f), with commands u and forces f at the
ports P. With both held constant over a step T, x[k+1] = A x[k] + H (u, f)[k] exactly, where [A H] are the upper rows of
exp([[F, G], [0, 0]] T) (Van Loan, IEEE Trans. Autom. Control 23:395, 1978). SI units.
"""

from dataclasses import dataclass

import numpy as np
from scipy.linalg import expm

from equalizer.plant.mechanical_model import DERIVATIVE_OF_QUANTITY, MechanicalModel
from equalizer.signals.signal import ComplexArray, FloatArray


@dataclass(frozen=True, slots=True, eq=False)
class DiscreteModel:
    """Discrete-time state-space matrices of one step. The state (q, v) has 2n elements for n coordinates; inputs are
    the m commands and the forces at r ports, both held during the step. There are p responses."""

    step_s: float
    """Duration T of a step (s)."""
    transition: FloatArray
    """(2n, 2n): state transition matrix A."""
    state_by_command: FloatArray
    """(2n, m): input matrix of the commands, the columns u of H."""
    state_by_port_force: FloatArray
    """(2n, r): input matrix of the port forces, the columns f of H; per N, or per N m for a torque."""
    motion: FloatArray
    """(3 r, 2n): output matrix of the ports: rows of all positions, then velocities, then accelerations."""
    motion_by_command: FloatArray
    """(3 r, m): feedthrough from the commands to `motion`; not zero for accelerations only."""
    motion_by_port_force: FloatArray
    """(3 r, r): feedthrough from the port forces to `motion`."""
    response: FloatArray
    """(p, 2n): output matrix of the responses, in the quantity of the model."""
    response_by_command: FloatArray
    """(p, m): feedthrough from the commands to the responses; not zero for an acceleration only."""
    response_by_port_force: FloatArray
    """(p, r): feedthrough from the port forces to the responses."""
    position: FloatArray
    """(p, 2n): output matrix of the positions at the responses, for any quantity of the model."""


def compute_driven_axes(model: MechanicalModel) -> FloatArray:
    """Compute the unit vectors (n, m) in the coordinates along which the m commands act; zeros for a command whose
    column of the input matrix is zero."""
    column_norms = np.linalg.norm(model.input, axis=0)
    return np.asarray(model.input / np.where(column_norms > 0, column_norms, 1.0))


def discretise_model(model: MechanicalModel, step_s: float, ports: FloatArray | None = None) -> DiscreteModel:
    """Discretise the linear mechanical part, without actuator, sensor and effects, with a step of `step_s`. ports: (n,
    r), directions in the coordinates along which forces act and motion is output; None = the driven axes. Raises
    numpy.linalg.LinAlgError for a singular mass matrix."""
    n, m = model.coordinates, model.inputs
    port_directions = compute_driven_axes(model) if ports is None else ports
    acceleration_by_input = np.asarray(
        np.linalg.solve(model.mass, np.hstack([model.input, port_directions])), dtype=np.float64
    )
    restoring_matrix = np.hstack([model.stiffness, model.damping])
    acceleration_by_state = -np.asarray(np.linalg.solve(model.mass, restoring_matrix), dtype=np.float64)
    state_count, input_count = 2 * n, m + port_directions.shape[1]
    generator_matrix = np.zeros((state_count + input_count, state_count + input_count))
    generator_matrix[:n, n:state_count] = np.eye(n)
    generator_matrix[n:state_count, :state_count] = acceleration_by_state
    generator_matrix[n:state_count, state_count:] = acceleration_by_input
    step_matrices = expm(generator_matrix * step_s)
    derivative_order = DERIVATIVE_OF_QUANTITY[model.quantity]
    response, response_by_input = _build_output_rows(
        model.output, derivative_order, acceleration_by_state, acceleration_by_input
    )
    motion = [
        _build_output_rows(port_directions.T, derivative, acceleration_by_state, acceleration_by_input)
        for derivative in range(3)
    ]
    return DiscreteModel(
        step_s=step_s,
        transition=step_matrices[:state_count, :state_count],
        state_by_command=step_matrices[:state_count, state_count : state_count + m],
        state_by_port_force=step_matrices[:state_count, state_count + m :],
        motion=np.vstack([rows for rows, _ in motion]),
        motion_by_command=np.vstack([feedthrough[:, :m] for _, feedthrough in motion]),
        motion_by_port_force=np.vstack([feedthrough[:, m:] for _, feedthrough in motion]),
        response=response,
        response_by_command=response_by_input[:, :m],
        response_by_port_force=response_by_input[:, m:],
        position=_build_output_rows(model.output, 0, acceleration_by_state, acceleration_by_input)[0],
    )


def _build_output_rows(
    output: FloatArray, derivative_order: int, acceleration_by_state: FloatArray, acceleration_by_input: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Build the output matrix (p, 2n) and the feedthrough (p, m + r) of a time derivative of the outputs. output: (p,
    n), outputs by the coordinates. derivative_order: 0 position, 1 velocity, 2 acceleration, whose feedthrough alone is
    not zero."""
    zeros, feedthrough = np.zeros_like(output), np.zeros((len(output), acceleration_by_input.shape[1]))
    if derivative_order == 0:
        return np.hstack([output, zeros]), feedthrough
    if derivative_order == 1:
        return np.hstack([zeros, output]), feedthrough
    return output @ acceleration_by_state, output @ acceleration_by_input


def compute_poles(model: MechanicalModel) -> ComplexArray:
    """Compute the poles (2n,), eigenvalues of the continuous-time state matrix, 1/s; complex ones in conjugate pairs.
    Raises numpy.linalg.LinAlgError for a singular mass matrix."""
    n = model.coordinates
    state_matrix = np.block(
        [
            [np.zeros((n, n)), np.eye(n)],
            [-np.linalg.solve(model.mass, model.stiffness), -np.linalg.solve(model.mass, model.damping)],
        ]
    )
    return np.asarray(np.linalg.eigvals(state_matrix), dtype=np.complex128)


def compute_growth_rate(model: MechanicalModel) -> float:
    """Compute the largest real part of the model's poles, 1/s; negative where all free motion decays."""
    return float(compute_poles(model).real.max())
