"""Time stepping of a linear structure in blocks of samples: unforced, or under motion-dependent forces.

Theory of operation. The structure M a + C v + K x = B u + F has the exact step of a command held over it,

    s(t + h) = A s(t) + B_u u + B_F F,    A = exp(h [[0, I], [-M^-1 K, -M^-1 C]])

s = (x, v) is the state, u the command, F the forces at the ports, h the step. `modal_form` puts A into 2 x 2 blocks, so
that a step costs O(n) instead of O(n²). Without motion-dependent forces a whole sample is one step. With them F depends
on the state within the step: each force law is evaluated at the position, velocity and acceleration of its port,
corrected for its own effect (`per_newton`), step by step in compiled code (`mechanism_kernel`). Many samples are
stepped per call, because a call of compiled code costs as much as many steps.

Reference: Van Loan, IEEE Trans. Autom. Control 23:395 (1978) (integrals of the matrix exponential).
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from equalizer.effects.simulation.instant import LENGTH, SEEN
from equalizer.effects.simulation.linear_step_kernel import advance_unforced
from equalizer.effects.simulation.mechanism_kernel import OWN_ROWS, PORT_ROWS, Integers, step_mechanism
from equalizer.effects.simulation.modal_form import step_form
from equalizer.plant.linear_simulation import LinearSteps
from equalizer.signals.signal import FloatArray

BLOCK, BLOCK_UNDER_FORCES = 4096, 32768
"""Samples per block without and with motion-dependent forces. The first fits the processor's cache; the second is
longer, because passing the laws to the kernel takes about 0.1 ms per call."""


@dataclass(frozen=True, slots=True, eq=False)
class Forces:
    """Forces in the form that the compiled kernel takes; see `mechanism_kernel.step_mechanism`."""

    ports: tuple[int, ...]
    """Indices of the ports at which the forces act."""
    laws: tuple[object, ...]
    """Addresses of the compiled laws, `LAWS` of them."""
    places: Integers
    """(items, 6): indices of law and port, ranges of parameters and memory of each force."""
    parameters: FloatArray
    """Parameters of all forces, one after another."""
    memory: FloatArray
    """Initial state variables of all forces, one after another."""
    acceleration: bool
    """Whether a law reads accelerations."""
    sees: bool
    """Whether a law reads the motion of all axes and the commands."""


@dataclass(frozen=True, slots=True, eq=False)
class Stepping:
    """Time stepping of the mechanism in blocks of samples, from rest; `run` keeps the state from block to block."""

    rows: int
    """Rows per sample of the drive (inputs columns) and of the array that `run` takes."""
    into: FloatArray
    """(inputs, s + r): from a row of the drive to its contributions to the state, and to the accelerations of the ports
    with forces."""
    outward: FloatArray
    """(2n, s): from the stepped coordinates to positions and velocities."""
    block: int
    """Samples stepped per call."""
    run: Callable[[FloatArray, int], None]
    """Steps one block, in succession from rest. Arguments: rows of the block (block rows, s + r ...), index of its
    first sample. On entry a row holds the contributions of its step; on return, the first row of each sample holds the
    state and the forces just before the sample."""
    begin: Callable[[FloatArray], None]
    """Continues from the given state (2n,) at the next block."""


def step_without_forces(linear: LinearSteps, steps: int, stride: int) -> Stepping:
    """Stepping without motion-dependent forces, a whole sample at once. steps: steps of `linear` per sample; stride:
    commands per sample, 1 where a command is held over all steps."""
    pushes = [linear.by_command]
    for _ in range(steps - 1):
        pushes.append(linear.advance @ pushes[-1])
    by_command = np.hstack(pushes[::-1]) if stride > 1 else np.sum(pushes, axis=0)
    form = step_form(np.linalg.matrix_power(linear.advance, steps))
    state = np.zeros(len(form.inward))

    def run(rows: FloatArray, first: int) -> None:
        advance_unforced(form.advance, rows, state)

    def begin(from_: FloatArray) -> None:
        state[:] = form.inward @ from_

    return Stepping(1, (form.inward @ by_command).T, form.outward, BLOCK, run, begin)


def step_with_forces(linear: LinearSteps, forces: Forces, steps: int, stride: int, commanded: FloatArray) -> Stepping:
    """Stepping under motion-dependent forces. steps, stride: as above. commanded: (n * stride, m), the commands, for
    laws that read them."""
    form = step_form(linear.advance)
    where, r = np.array(forces.ports), linear.by_axis_force.shape[1]
    output = linear.motion[np.concatenate([where, r + where, 2 * r + where])]
    by_force = linear.by_axis_force[:, where]
    per_newton = output @ by_force
    per_newton[2 * len(where) :] = linear.motion_by_axis_force[2 * r + where][:, where]
    asked = output if forces.acceleration else output[: 2 * len(where)]
    outward, inward = asked @ form.outward, (form.inward @ by_force).T
    step = (form.advance, _contiguous(outward), _contiguous(inward), _contiguous(per_newton.T))
    into = np.hstack([(form.inward @ linear.by_command).T, linear.motion_by_command[2 * r + where].T])
    commands = np.ascontiguousarray(commanded, dtype=np.float64) if forces.sees else np.empty((0, 0))
    state, ports, memory = np.zeros(len(form.inward)), np.zeros((PORT_ROWS, len(where))), forces.memory.copy()

    own = np.zeros((OWN_ROWS, len(forces.places)))
    at = np.zeros(LENGTH + SEEN * len(where) if forces.sees else LENGTH)
    scratch = np.zeros(len(state) + len(where)), at, own, np.zeros_like(memory)

    def run(rows: FloatArray, first: int) -> None:
        step_mechanism(
            forces.laws, forces.places, forces.parameters, memory, step, rows,
            commands[first * stride : first * stride + len(rows)], ports, state, (steps, stride, first),
            linear.step_s, *scratch,
        )  # fmt: skip

    def begin(from_: FloatArray) -> None:
        state[:] = form.inward @ from_
        # No extrapolation from the forces before the restart. The laws' memory is kept.
        own[:] = 0.0
        ports[:2] = (output[: 2 * len(where)] @ from_).reshape(2, -1)

    return Stepping(stride, into, form.outward, BLOCK_UNDER_FORCES, run, begin)


def _contiguous(matrix: FloatArray) -> FloatArray:
    return np.ascontiguousarray(matrix)
