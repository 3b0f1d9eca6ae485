"""Compiled loop that evaluates motion-dependent force laws along a known motion, for `forces_along_motion`.

A law reads the motion at a step's start and the motion that the step would have without the law's force (layout in
`instant`). The latter is the measured motion at the step's end plus the effect of the force that is still unbalanced.
"""

from typing import Any

import numpy as np
from numba import njit, types

from equalizer.effects.simulation.instant import (
    A_FREE,
    A_PER_N,
    AXIS_A,
    AXIS_A_PER_N,
    AXIS_COMMAND,
    AXIS_V,
    AXIS_V_END,
    AXIS_V_PER_N,
    AXIS_X,
    AXIS_X_END,
    AXIS_X_PER_N,
    BLOCK_SIZE,
    F_END,
    LENGTH,
    STEP_S,
    TIME_S,
    V_FREE,
    V_PER_N,
    X_FREE,
    X_PER_N,
    V,
    X,
)
from equalizer.effects.simulation.mechanism_kernel import LAW, MAX_LAWS, READ_ONLY_MATRIX, Integers
from equalizer.signals.signal import FloatArray

_VECTOR = types.float64[::1]
_MATRIX = types.float64[:, ::1]
_THREE_MATRICES = types.UniTuple(_MATRIX, 3)  # type: ignore[no-untyped-call]
_LAWS = types.UniTuple(types.FunctionType(LAW), MAX_LAWS)  # type: ignore[no-untyped-call]
"""Numba types of the arguments of `evaluate_laws_along_motion`."""

Motion = tuple[FloatArray, FloatArray, FloatArray]
"""Positions, velocities and accelerations, (n, m) each."""


@njit(inline="always")
def _write_all_axes(
    k: int, axis: int, motion: Motion, commands: FloatArray, per_newton: FloatArray, step_motion: FloatArray
) -> None:
    """Write motion and command of all axes at step k into `step_motion`. The effect of one axis's force on the others
    is contained in their measured motion."""
    for read_axis in range(commands.shape[1]):
        block, own_axis_factor = LENGTH + BLOCK_SIZE * read_axis, 1.0 if read_axis == axis else 0.0
        step_motion[block + AXIS_X] = motion[0][k, read_axis]
        step_motion[block + AXIS_V] = motion[1][k, read_axis]
        step_motion[block + AXIS_A] = motion[2][k, read_axis]
        step_motion[block + AXIS_X_END] = motion[0][k + 1, read_axis]
        step_motion[block + AXIS_V_END] = motion[1][k + 1, read_axis]
        step_motion[block + AXIS_X_PER_N] = own_axis_factor * per_newton[0, read_axis]
        step_motion[block + AXIS_V_PER_N] = own_axis_factor * per_newton[1, read_axis]
        step_motion[block + AXIS_A_PER_N] = own_axis_factor * per_newton[2, read_axis]
        step_motion[block + AXIS_COMMAND] = commands[k, read_axis]


@njit(
    types.void(
        _LAWS, types.int64[:, ::1], _VECTOR, _VECTOR, _THREE_MATRICES, READ_ONLY_MATRIX, _MATRIX, _MATRIX, types.float64
    ),
    cache=True, nogil=True, error_model="numpy",
)  # fmt: skip
def evaluate_laws_along_motion(  # noqa: PLR0913 - a kernel takes flat arrays
    laws: Any, places: Integers, parameters: FloatArray, memory: FloatArray,
    motion: Motion, commands: FloatArray, per_newton: FloatArray,
    force: FloatArray, step_s: float,
) -> None:  # fmt: skip
    """Overwrite force (n, m) by the sum of the laws' forces over the step that begins at each sample.

    force, on entry: unbalanced force over each step (see `forces_along_motion.compute_effect_forces_along_motion`),
    from which friction at rest follows, because it does not follow from the motion. commands: (n, m), or (0, 0) where
    no law reads them. per_newton: (3, m), position, velocity and acceleration that 1 N over a step adds. places:
    (placed laws, 6), index of law and of axis, begin and end (exclusive) in `parameters`, then in `memory`. The last
    row of force repeats the row before it."""
    position, velocity, acceleration = motion
    reads_all_axes = commands.shape[0] > 0
    step_motion = np.zeros(LENGTH + BLOCK_SIZE * force.shape[1] if reads_all_axes else LENGTH)
    step_motion[STEP_S] = step_s
    for k in range(len(position) - 1):
        step_motion[TIME_S] = k * step_s
        unbalanced_force = force[k].copy()
        force[k] = 0.0
        for place_index in range(places.shape[0]):
            axis = places[place_index, 1]
            step_motion[X], step_motion[V] = position[k, axis], velocity[k, axis]
            step_motion[X_PER_N] = per_newton[0, axis]
            step_motion[V_PER_N] = per_newton[1, axis]
            step_motion[A_PER_N] = per_newton[2, axis]
            step_motion[X_FREE] = position[k + 1, axis] + step_motion[X_PER_N] * unbalanced_force[axis]
            step_motion[V_FREE] = velocity[k + 1, axis] + step_motion[V_PER_N] * unbalanced_force[axis]
            step_motion[A_FREE] = acceleration[k, axis] + step_motion[A_PER_N] * unbalanced_force[axis]
            step_motion[F_END] = np.nan
            if reads_all_axes:
                _write_all_axes(k, axis, motion, commands, per_newton, step_motion)
                step_motion[LENGTH + BLOCK_SIZE * axis + AXIS_X_END] = step_motion[X_FREE]
                step_motion[LENGTH + BLOCK_SIZE * axis + AXIS_V_END] = step_motion[V_FREE]
                step_motion[LENGTH + BLOCK_SIZE * axis + AXIS_A] = step_motion[A_FREE]
            law_memory = memory[places[place_index, 4] : places[place_index, 5]]
            # The law's force balances a part of the unbalanced force; the next law reads the rest.
            law_force = laws[places[place_index, 0]](
                parameters[places[place_index, 2] : places[place_index, 3]], law_memory, step_motion
            )
            force[k, axis] += law_force
            unbalanced_force[axis] += law_force
    force[len(position) - 1] = force[len(position) - 2]
