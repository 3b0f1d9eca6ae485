"""Time stepping of a linear structure in blocks of samples: unforced, or under motion-dependent forces."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from equalizer.effects.simulation.linear_step_kernel import advance_unforced
from equalizer.effects.simulation.mechanism_kernel import PORT_ROWS, Integers, step_mechanism
from equalizer.effects.simulation.modal_form import step_form
from equalizer.plant.linear_simulation import LinearSteps
from equalizer.signals.signal import FloatArray

BLOCK, BLOCK_UNDER_FORCES = 4096, 32768
"""Samples. The first stays in a processor's cache; to hand over laws takes some 0.1 ms each time."""


@dataclass(frozen=True, slots=True, eq=False)
class Forces:
    """Forces in the form that the compiled kernel takes; see `mechanism_kernel.step_mechanism`."""

    ports: tuple[int, ...]
    """Where they act."""
    laws: tuple[object, ...]
    places: Integers
    """(items, 6)"""
    numbers: FloatArray
    memory: FloatArray
    acceleration: bool
    """Some law asks for it."""
    sees: bool
    """Some law asks for all axes and commands."""


@dataclass(frozen=True, slots=True, eq=False)
class Stepping:
    rows: int
    """Per sample, of what drives, each as wide as `into` is high; and of the course."""
    into: FloatArray
    """(inputs, s + r): what a row of these adds to the state, and to the accelerations of the ports with forces."""
    outward: FloatArray
    """(2n, s): from the stepped coordinates to positions and velocities."""
    block: int
    """Samples to be stepped at once."""
    run: Callable[[FloatArray, int], None]
    """Block after block from rest: course (block rows, s + r ...), the first sample's number. What was added over each
    step becomes, in each sample's first row, the state and the forces just before it."""
    begin: Callable[[FloatArray], None]
    """Lets the next block begin from another state (2n,) than that which was reached."""


def unforced_stepping(linear: LinearSteps, steps: int, stride: int) -> Stepping:
    """Stepping without motion-dependent forces, a whole sample at once. stride: commands per sample; 1 where they are
    held over all `steps`."""
    pushes = [linear.by_command]
    for _ in range(steps - 1):
        pushes.append(linear.advance @ pushes[-1])
    by_command = np.hstack(pushes[::-1]) if stride > 1 else np.sum(pushes, axis=0)
    form = step_form(np.linalg.matrix_power(linear.advance, steps))
    state = np.zeros(len(form.inward))

    def run(course: FloatArray, first: int) -> None:
        advance_unforced(form.advance, course, state)

    def begin(from_: FloatArray) -> None:
        state[:] = form.inward @ from_

    return Stepping(1, (form.inward @ by_command).T, form.outward, BLOCK, run, begin)


def forced_stepping(linear: LinearSteps, forces: Forces, steps: int, stride: int, commanded: FloatArray) -> Stepping:
    """Stepping under motion-dependent forces. commanded: (n stride, m), for laws that see the commands."""
    form = step_form(linear.advance)
    where, r = np.array(forces.ports), linear.by_axis_force.shape[1]
    look = linear.motion[np.concatenate([where, r + where, 2 * r + where])]
    by_force = linear.by_axis_force[:, where]
    per_newton = look @ by_force
    per_newton[2 * len(where) :] = linear.motion_by_axis_force[2 * r + where][:, where]
    asked = look if forces.acceleration else look[: 2 * len(where)]
    outward, inward = asked @ form.outward, (form.inward @ by_force).T
    step = (form.advance, _contiguous(outward), _contiguous(inward), _contiguous(per_newton.T))
    into = np.hstack([(form.inward @ linear.by_command).T, linear.motion_by_command[2 * r + where].T])
    seen = np.ascontiguousarray(commanded, dtype=np.float64) if forces.sees else np.empty((0, 0))
    state, ports, memory = np.zeros(len(form.inward)), np.zeros((PORT_ROWS, len(where))), forces.memory.copy()

    def run(course: FloatArray, first: int) -> None:
        step_mechanism(
            forces.laws, forces.places, forces.numbers, memory, step, course,
            seen[first * stride : first * stride + len(course)], ports, state, (steps, stride, first),
            linear.step_s,
        )  # fmt: skip

    def begin(from_: FloatArray) -> None:
        state[:] = form.inward @ from_
        ports[:2] = (look[: 2 * len(where)] @ from_).reshape(2, -1)

    return Stepping(stride, into, form.outward, BLOCK_UNDER_FORCES, run, begin)


def _contiguous(matrix: FloatArray) -> FloatArray:
    return np.ascontiguousarray(matrix)
