"""How a motion is stepped, block by block of samples: alone, or under forces that depend on it."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from equalizer.effects.simulation.linear_step_kernel import coast
from equalizer.effects.simulation.mechanism_kernel import PORT_ROWS, Integers, play
from equalizer.effects.simulation.modal_form import step_form
from equalizer.plant.linear_simulation import LinearSteps
from equalizer.signals.signal import FloatArray

BLOCK, BLOCK_UNDER_FORCES = 4096, 32768
"""Samples. The first stays in a processor's cache; to hand over laws takes some 0.3 ms each time."""


@dataclass(frozen=True, slots=True, eq=False)
class Forces:
    """What the compiled kernel is told of the forces; see `equalizer.effects.simulation.mechanism_kernel.play`."""

    ports: tuple[int, ...]
    """Where they act."""
    laws: tuple[object, ...]
    places: Integers
    """(items, 6)"""
    of: FloatArray
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


def coasting(linear: LinearSteps, steps: int, stride: int) -> Stepping:
    """Whole samples at once, whatever moves the command within them. stride: steps between two commands of a sample's
    `steps`, which are held over all of them where it is 1."""
    pushes = [linear.by_command]
    for _ in range(steps - 1):
        pushes.append(linear.advance @ pushes[-1])
    by_command = np.hstack(pushes[::-1]) if stride > 1 else np.sum(pushes, axis=0)
    form = step_form(np.linalg.matrix_power(linear.advance, steps))
    state = np.zeros(len(form.inward))

    def run(course: FloatArray, first: int) -> None:
        coast(form.advance, course, state)

    def begin(from_: FloatArray) -> None:
        state[:] = form.inward @ from_

    return Stepping(1, (form.inward @ by_command).T, form.outward, BLOCK, run, begin)


def pushed(linear: LinearSteps, forces: Forces, steps: int, stride: int, commanded: FloatArray) -> Stepping:
    """commanded: (n stride, m)"""
    form = step_form(linear.advance)
    where, r = np.array(forces.ports), linear.by_axis_force.shape[1]
    look = linear.motion[np.concatenate([where, r + where, 2 * r + where])]
    by_force = linear.by_axis_force[:, where]
    per_newton = look @ by_force
    per_newton[2 * len(where) :] = linear.motion_by_axis_force[2 * r + where][:, where]
    asked = look if forces.acceleration else look[: 2 * len(where)]
    outward, inward = asked @ form.outward, (form.inward @ by_force).T
    step = (form.advance, _whole(outward), _whole(inward), _whole(per_newton.T))
    into = np.hstack([(form.inward @ linear.by_command).T, linear.motion_by_command[2 * r + where].T])
    seen = np.ascontiguousarray(commanded, dtype=np.float64) if forces.sees else np.empty((0, 0))
    state, ports, memory = np.zeros(len(form.inward)), np.zeros((PORT_ROWS, len(where))), forces.memory.copy()

    def run(course: FloatArray, first: int) -> None:
        play(
            forces.laws, forces.places, forces.of, memory, step, course,
            seen[first * stride : first * stride + len(course)], ports, state, (steps, stride, first),
            linear.step_s,
        )  # fmt: skip

    def begin(from_: FloatArray) -> None:
        state[:] = form.inward @ from_
        ports[:2] = (look[: 2 * len(where)] @ from_).reshape(2, -1)

    return Stepping(stride, into, form.outward, BLOCK_UNDER_FORCES, run, begin)


def _whole(matrix: FloatArray) -> FloatArray:
    return np.ascontiguousarray(matrix)
