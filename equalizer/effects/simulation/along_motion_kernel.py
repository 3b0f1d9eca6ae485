"""Compiled loop that evaluates motion-dependent force laws along a known motion, for `along_motion`.

A law reads the motion at a step's start and the motion that the step would have without the law's force (layout in
`instant`). The latter is the measured motion at the step's end plus the effect of the force that is still unbalanced.
"""

from typing import Any

import numpy as np
from numba import njit, types

from equalizer.effects.simulation.instant import (
    A_FREE,
    A_PER_N,
    F_END,
    LENGTH,
    SEEN,
    SEEN_A,
    SEEN_A_PER_N,
    SEEN_COMMAND,
    SEEN_V,
    SEEN_V_END,
    SEEN_V_PER_N,
    SEEN_X,
    SEEN_X_END,
    SEEN_X_PER_N,
    STEP_S,
    TIME_S,
    V_FREE,
    V_PER_N,
    X_FREE,
    X_PER_N,
    V,
    X,
)
from equalizer.effects.simulation.mechanism_kernel import LAW, LAWS, READ_ONLY, Integers
from equalizer.signals.signal import FloatArray

_VECTOR = types.float64[::1]
_MATRIX = types.float64[:, ::1]
_THREE = types.UniTuple(_MATRIX, 3)  # type: ignore[no-untyped-call]
_LAWS = types.UniTuple(types.FunctionType(LAW), LAWS)  # type: ignore[no-untyped-call]

Motion = tuple[FloatArray, FloatArray, FloatArray]
"""Positions, velocities and accelerations, (n, m) each."""


@njit(inline="always")
def _write_seen_axes(
    k: int, axis: int, motion: Motion, commands: FloatArray, per_newton: FloatArray, at: FloatArray
) -> None:
    """Write the motion of all axes into `at`. The effect of one axis's force on the others is contained in their
    measured motion."""
    for other in range(commands.shape[1]):
        begin, own = LENGTH + SEEN * other, 1.0 if other == axis else 0.0
        at[begin + SEEN_X], at[begin + SEEN_V] = motion[0][k, other], motion[1][k, other]
        at[begin + SEEN_X_END], at[begin + SEEN_V_END] = motion[0][k + 1, other], motion[1][k + 1, other]
        at[begin + SEEN_X_PER_N], at[begin + SEEN_V_PER_N] = own * per_newton[0, other], own * per_newton[1, other]
        at[begin + SEEN_A], at[begin + SEEN_A_PER_N] = motion[2][k, other], own * per_newton[2, other]
        at[begin + SEEN_COMMAND] = commands[k, other]


@njit(
    types.void(_LAWS, types.int64[:, ::1], _VECTOR, _VECTOR, _THREE, READ_ONLY, _MATRIX, _MATRIX, types.float64),
    cache=True, nogil=True, error_model="numpy",
)  # fmt: skip
def run_laws_along(  # noqa: PLR0913 - a kernel takes flat arrays
    laws: Any, places: Integers, parameters: FloatArray, memory: FloatArray,
    motion: Motion, commands: FloatArray, per_newton: FloatArray,
    force: FloatArray, step_s: float,
) -> None:  # fmt: skip
    """Overwrite force (n, m) by the sum of the laws' forces over the step that begins at each sample.

    force, on entry: unbalanced force over each step (see `along_motion.force_along`), from which friction at rest
    follows, because it does not follow from the motion. motion: positions, velocities and accelerations, (n, m) each.
    commands: (n, m), or (0, 0) where no law reads them. per_newton: (3, m), what 1 N over a step adds to the motion.
    places: (items, 6) law, axis, begin and end in `parameters`, begin and end in `memory`.
    """
    position, velocity, acceleration = motion
    sees = commands.shape[0] > 0
    at = np.zeros(LENGTH + SEEN * force.shape[1] if sees else LENGTH)
    at[STEP_S] = step_s
    for k in range(len(position) - 1):
        at[TIME_S] = k * step_s
        pushing = force[k].copy()
        force[k] = 0.0
        for item in range(places.shape[0]):
            axis = places[item, 1]
            at[X], at[V] = position[k, axis], velocity[k, axis]
            at[X_PER_N], at[V_PER_N], at[A_PER_N] = per_newton[0, axis], per_newton[1, axis], per_newton[2, axis]
            at[X_FREE] = position[k + 1, axis] + at[X_PER_N] * pushing[axis]
            at[V_FREE] = velocity[k + 1, axis] + at[V_PER_N] * pushing[axis]
            at[A_FREE] = acceleration[k, axis] + at[A_PER_N] * pushing[axis]
            at[F_END] = np.nan
            if sees:
                _write_seen_axes(k, axis, motion, commands, per_newton, at)
                at[LENGTH + SEEN * axis + SEEN_X_END] = at[X_FREE]
                at[LENGTH + SEEN * axis + SEEN_V_END] = at[V_FREE]
                at[LENGTH + SEEN * axis + SEEN_A] = at[A_FREE]
            kept = memory[places[item, 4] : places[item, 5]]
            # The law's force balances a part of the unbalanced force; the next law sees what remains.
            added = laws[places[item, 0]](parameters[places[item, 2] : places[item, 3]], kept, at)
            force[k, axis] += added
            pushing[axis] += added
    force[len(position) - 1] = force[len(position) - 2]
