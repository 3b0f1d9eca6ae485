"""Time stepping of a linear structure in blocks of samples: unforced, or under motion-dependent forces.

Theory of operation. The structure M a + C v + K x = B u + F has the exact step of a command held over it,

    s(t + h) = A s(t) + B_u u + B_F F,    A = exp(h [[0, I], [-M^-1 K, -M^-1 C]])

s = (x, v) is the state, u the command, F the forces at the ports, h the step. `modal_form` puts A into 2 x 2
blocks where that is accurate; a step then costs O(n) instead of O(n²). Without motion-dependent forces a whole sample
is one step. With them F depends on the state within the step: each force law is evaluated at the position, velocity and
acceleration of its port, corrected for its own effect (`per_newton`), step by step in compiled code
(`mechanism_kernel`), many samples per call.

Sizes: n coordinates, m commands, s states in modal form, r ports with forces, L samples.

Reference: Van Loan, IEEE Trans. Autom. Control 23:395 (1978) (integrals of the matrix exponential).
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from equalizer.effects.simulation.instant import BLOCK_SIZE, LENGTH
from equalizer.effects.simulation.linear_step_kernel import advance_unforced
from equalizer.effects.simulation.mechanism_kernel import FORCE_ROWS, PORT_ROWS, Integers, step_mechanism
from equalizer.effects.simulation.modal_form import build_step_form
from equalizer.plant.linear_simulation import DiscreteModel
from equalizer.signals.signal import FloatArray

BLOCK, BLOCK_UNDER_FORCES = 4096, 32768
"""Samples per block without and with motion-dependent forces. The first fits the processor's cache; the second is
longer, because passing the laws to the kernel takes about 0.1 ms per call."""


@dataclass(frozen=True, slots=True, eq=False)
class Forces:
    """Motion-dependent forces in the form that the compiled kernel takes; see `mechanism_kernel.step_mechanism`."""

    ports: tuple[int, ...]
    """Indices of the ports at which the forces act."""
    laws: tuple[object, ...]
    """Addresses of the compiled laws, `MAX_LAWS` of them."""
    force_indices: Integers
    """(number of forces, 6): indices of law and port, ranges of parameters and memory of each force."""
    parameters: FloatArray
    """Parameters of all forces, one after another."""
    memory: FloatArray
    """Initial state variables of all forces, one after another."""
    reads_acceleration: bool
    """Whether a law reads accelerations."""
    reads_all_axes: bool
    """Whether a law reads the motion of all axes and the commands."""


@dataclass(frozen=True, slots=True, eq=False)
class Stepping:
    """Procedures and matrices to step a structure in blocks of samples; its state is kept between calls of `run`."""

    rows_per_sample: int
    """Rows per sample of the drive (one column per input) and of the array that `run` takes."""
    input_matrix: FloatArray
    """(inputs, s + r): from a row of the drive to its contributions to the state, and to the accelerations of the r
    ports with forces."""
    state_from_modal: FloatArray
    """(2n, s): from the stepped coordinates to positions and velocities."""
    samples_per_block: int
    """Samples stepped per call."""
    run: Callable[[FloatArray, int], None]
    """Advances the state by one block, from rest, where the previous block ended, or as `set_state` sets it.
    Arguments: rows of the block (at most samples_per_block * rows_per_sample, s + r or more), and the index of its
    first sample. On entry a row holds the contributions of its step; on return, the first row of each sample holds the
    state and the forces just before the sample."""
    set_state: Callable[[FloatArray], None]
    """Sets the state (2n,), positions then velocities, from which the next block starts."""


def build_unforced_stepping(linear: DiscreteModel, steps: int, stride: int) -> Stepping:
    """Build the stepping without motion-dependent forces, a whole sample at once, from rest. steps: steps of
    `linear` per sample; stride: commands per sample, `steps`, or 1 where a command is held over all steps."""
    responses = [linear.state_by_command]
    for _ in range(steps - 1):
        responses.append(linear.transition @ responses[-1])
    by_command = np.hstack(responses[::-1]) if stride > 1 else np.sum(responses, axis=0)
    form = build_step_form(np.linalg.matrix_power(linear.transition, steps))
    state = np.zeros(len(form.modal_from_state))

    def run(rows: FloatArray, first: int) -> None:
        """Advance the state by one block; `first` has no effect, because nothing depends on the time."""
        advance_unforced(form.step_matrix, rows, state)

    def set_state(initial_state: FloatArray) -> None:
        """Set the state (2n,), positions then velocities: `Stepping.set_state`."""
        state[:] = form.modal_from_state @ initial_state

    return Stepping(1, (form.modal_from_state @ by_command).T, form.state_from_modal, BLOCK, run, set_state)


def build_forced_stepping(
    linear: DiscreteModel, forces: Forces, steps: int, stride: int, commands: FloatArray
) -> Stepping:
    """Build the stepping under motion-dependent forces, from rest. steps: steps of `linear` per sample; stride:
    commands per sample, `steps`, or 1 where a command is held over all steps. commands: (L * stride, m), for laws that
    read them."""
    form = build_step_form(linear.transition)
    port_indices, axis_count = np.array(forces.ports), linear.state_by_port_force.shape[1]
    output = linear.motion[np.concatenate([port_indices, axis_count + port_indices, 2 * axis_count + port_indices])]
    by_force = linear.state_by_port_force[:, port_indices]
    per_newton = output @ by_force
    per_newton[2 * len(port_indices) :] = linear.motion_by_port_force[2 * axis_count + port_indices][:, port_indices]
    law_output = output if forces.reads_acceleration else output[: 2 * len(port_indices)]
    port_output, force_input = law_output @ form.state_from_modal, (form.modal_from_state @ by_force).T
    step_matrices = (form.step_matrix, _pack_by_row(port_output), _pack_by_row(force_input), _pack_by_row(per_newton.T))
    input_matrix = np.hstack(
        [(form.modal_from_state @ linear.state_by_command).T, linear.motion_by_command[2 * axis_count + port_indices].T]
    )
    read_commands = np.ascontiguousarray(commands, dtype=np.float64) if forces.reads_all_axes else np.empty((0, 0))
    state, ports, memory = (
        np.zeros(len(form.modal_from_state)),
        np.zeros((PORT_ROWS, len(port_indices))),
        forces.memory.copy(),
    )

    force_history = np.zeros((FORCE_ROWS, len(forces.force_indices)))
    step_motion = np.zeros(LENGTH + BLOCK_SIZE * len(port_indices) if forces.reads_all_axes else LENGTH)
    scratch = np.zeros(len(state) + len(port_indices)), step_motion, force_history, np.zeros_like(memory)

    def run(rows: FloatArray, first: int) -> None:
        step_mechanism(
            forces.laws, forces.force_indices, forces.parameters, memory, step_matrices, rows,
            read_commands[first * stride : first * stride + len(rows)], ports, state, (steps, stride, first),
            linear.step_s, *scratch,
        )  # fmt: skip

    def set_state(initial_state: FloatArray) -> None:
        state[:] = form.modal_from_state @ initial_state
        # No extrapolation from the forces before the restart. The laws' memory is kept.
        force_history[:] = 0.0
        ports[:2] = (output[: 2 * len(port_indices)] @ initial_state).reshape(2, -1)

    return Stepping(stride, input_matrix, form.state_from_modal, BLOCK_UNDER_FORCES, run, set_state)


def _pack_by_row(matrix: FloatArray) -> FloatArray:
    """Pack a matrix in row-major (C) order, for which the kernel is compiled."""
    return np.ascontiguousarray(matrix)
