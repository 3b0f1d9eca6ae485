"""The motion of a linear structure under commands and under forces that depend on the motion, step by step, compiled.

Between steps everything linear is exact; a motion-dependent force is found once per step and held over it.
"""

import warnings
from collections.abc import Callable
from typing import Any

import numpy as np
import numpy.typing as npt
from numba import njit, types
from numba.core.errors import NumbaExperimentalFeatureWarning

from equalizer.effects.instant import (
    A_FREE,
    A_PER_N,
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
from equalizer.signals.signal import FloatArray

LAWS = 6
"""How many different laws can act at once."""
SWEEPS = 3
"""Over all forces per step, where there are several: each is found again with the others as they have become."""
_VECTOR = types.float64[::1]
_MATRIX = types.float64[:, ::1]
_PLACES = types.int64[:, ::1]
LAW = types.float64(_VECTOR, _VECTOR, _VECTOR)
"""What every law of force is compiled as."""

Integers = npt.NDArray[np.int64]
Three = tuple[FloatArray, FloatArray, FloatArray]

_THREE = types.UniTuple(_MATRIX, 3)  # type: ignore[no-untyped-call]
_TWO = types.UniTuple(_MATRIX, 2)  # type: ignore[no-untyped-call]
_LAWS = types.UniTuple(types.FunctionType(LAW), LAWS)  # type: ignore[no-untyped-call]
_PLAY = types.void(
    _LAWS, _PLACES, _VECTOR, _VECTOR, _THREE, _THREE, _THREE, _MATRIX, _VECTOR, _TWO, types.int64, types.float64
)


def compiled_law(law: Callable[[FloatArray, FloatArray, FloatArray], float]) -> Any:
    """The law, ready to be called from the kernel. Its machine code is kept on disk with its own file."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", NumbaExperimentalFeatureWarning)
        return njit(LAW, cache=True, error_model="numpy")(law)


with warnings.catch_warnings():
    # Laws are passed as values, so that a changed law never runs as it was in a kept kernel.
    warnings.simplefilter("ignore", NumbaExperimentalFeatureWarning)

    @compiled_law
    def no_force(of: FloatArray, memory: FloatArray, at: FloatArray) -> float:
        return 0.0

    @njit(types.void(_VECTOR, _MATRIX, _VECTOR), cache=True, fastmath={"reassoc", "contract"})
    def _add(out: FloatArray, matrix: FloatArray, by: FloatArray) -> None:
        """out += matrix.T @ by; matrices are kept transposed, so that the inner loop runs along memory."""
        for j in range(matrix.shape[0]):
            b = by[j]
            for i in range(out.shape[0]):
                out[i] += matrix[j, i] * b

    @njit(types.float64(_MATRIX, types.int64, _VECTOR), cache=True, fastmath={"reassoc", "contract"})
    def _row(matrix: FloatArray, row: int, by: FloatArray) -> float:
        total = 0.0
        for j in range(by.shape[0]):
            total += matrix[row, j] * by[j]
        return total

    @njit(
        types.void(_LAWS, _PLACES, _VECTOR, _VECTOR, _THREE, _VECTOR, _VECTOR, _VECTOR, _MATRIX, _MATRIX, _VECTOR),
        cache=True, nogil=True, error_model="numpy",
    )  # fmt: skip
    def _push(  # noqa: PLR0913 - a kernel takes flat arrays
        laws: Any, places: Integers, of: FloatArray, memory: FloatArray, motion: Three, state: FloatArray,
        u: FloatArray, free: FloatArray, by_force: FloatArray, force: FloatArray, at: FloatArray,
    ) -> None:  # fmt: skip
        """Finds the forces (2, ports) over one step and at its end, and lets them act on `free`, the state at its end
        without them."""
        ports = force.shape[1]
        before, items = memory.copy(), places.shape[0]
        own, own_end = np.zeros(items), np.zeros(items)
        force[:] = 0.0
        for sweep in range(SWEEPS if items > 1 else 1):
            for item in range(items):
                port, kept, end = places[item, 1], places[item, 4], places[item, 5]
                if sweep > 0:
                    force[0, port] -= own[item]
                    force[1, port] -= own_end[item]
                    for i in range(free.shape[0]):
                        free[i] -= by_force[port, i] * own[item]
                    memory[kept:end] = before[kept:end]
                at[X], at[V] = _row(motion[0], port, state), _row(motion[0], ports + port, state)
                at[X_FREE], at[V_FREE] = _row(motion[0], port, free), _row(motion[0], ports + port, free)
                at[X_PER_N] = _row(motion[0], port, by_force[port])
                at[V_PER_N] = _row(motion[0], ports + port, by_force[port])
                row = 2 * ports + port
                at[A_FREE] = _row(motion[0], row, state) + _row(motion[1], row, u) + _row(motion[2], row, force[0])
                at[A_PER_N] = motion[2][row, port]
                at[F_END] = np.nan
                added = laws[places[item, 0]](of[places[item, 2] : places[item, 3]], memory[kept:end], at)
                own[item] = added
                own_end[item] = added if np.isnan(at[F_END]) else at[F_END]
                force[0, port] += added
                force[1, port] += own_end[item]
                for i in range(free.shape[0]):
                    free[i] += by_force[port, i] * added

    @njit(_PLAY, cache=True, nogil=True, error_model="numpy")
    def play(  # noqa: PLR0913 - a kernel takes flat arrays
        laws: Any, places: Integers, of: FloatArray, memory: FloatArray, advance: Three, look: Three, motion: Three,
        command: FloatArray, state: FloatArray, out: tuple[FloatArray, FloatArray], steps: int, step_s: float,
    ) -> None:  # fmt: skip
        """Fills out = (what is looked at (n, rows), forces (n, ports)), as they are just before a command is written.

        places: (items, 6) law, port, begin and end in `of`, begin and end in `memory`. advance: transposed, (s, s),
        (m, s) and (ports, s). look: transposed, (s, rows), (m, rows), (ports, rows). motion: (3 ports, s), (3 ports, m)
        and (3 ports, ports), the ports' positions, velocities and accelerations. command: (n, m), or (n steps, m).
        """
        looked, forces = out
        n, ports, size = looked.shape[0], forces.shape[1], state.shape[0]
        fine = command.shape[0] == n * steps and steps > 1
        free, before, force = np.empty(size), np.zeros(command.shape[1]), np.zeros((2, ports))
        at, seen = np.zeros(LENGTH), np.empty(looked.shape[1])
        at[STEP_S] = step_s
        for k in range(n):
            seen[:] = 0.0
            _add(seen, look[0], state)
            _add(seen, look[1], before)
            _add(seen, look[2], force[1])
            looked[k] = seen
            forces[k] = force[1]
            for step in range(steps):
                u = command[k * steps + step] if fine else command[k]
                free[:] = 0.0
                _add(free, advance[0], state)
                _add(free, advance[1], u)
                if len(places):
                    at[TIME_S] = (k * steps + step) * step_s
                    _push(laws, places, of, memory, motion, state, u, free, advance[2], force, at)
                state[:] = free
                before[:] = u
