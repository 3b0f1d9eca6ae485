"""The motion of a linear structure under commands and under forces that depend on the motion, step by step, compiled.

Between steps everything linear is exact; a motion-dependent force is found once per step and held over it.
"""

import warnings

import numpy as np
import numpy.typing as npt
from numba import njit, types
from numba.core.errors import NumbaExperimentalFeatureWarning

from equalizer.effects.instant import A_FREE, A_PER_N, LENGTH, STEP_S, TIME_S, V_FREE, V_PER_N, X_FREE, X_PER_N, V, X
from equalizer.signals.signal import FloatArray

LAWS = 6
"""How many different laws can act at once."""
_VECTOR = types.float64[::1]
_MATRIX = types.float64[:, ::1]
_PLACES = types.int64[:, ::1]
LAW = types.float64(_VECTOR, _VECTOR, _VECTOR)
"""What every law of force is compiled as."""

Integers = npt.NDArray[np.int64]


def compiled_law(law: object) -> object:
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

    @njit(
        types.void(
            types.UniTuple(types.FunctionType(LAW), LAWS), _PLACES, _VECTOR, _VECTOR,
            types.UniTuple(_MATRIX, 3), types.UniTuple(_MATRIX, 3), _MATRIX, _MATRIX, _VECTOR,
            types.UniTuple(_MATRIX, 2), types.int64, types.float64,
        ),
        cache=True, nogil=True, error_model="numpy",
    )  # fmt: skip
    def play(  # noqa: PLR0913 - a kernel takes flat arrays
        laws: object, places: Integers, of: FloatArray, memory: FloatArray,
        advance: tuple[FloatArray, FloatArray, FloatArray], look: tuple[FloatArray, FloatArray, FloatArray],
        per_newton: FloatArray, command: FloatArray, state: FloatArray,
        out: tuple[FloatArray, FloatArray], steps: int, step_s: float,
    ) -> None:  # fmt: skip
        """Fills out = (what is looked at (n, rows), forces (n, ports)), as they are just before each command is written.

        places: (items, 6) law, port, begin and end in `of`, begin and end in `memory`. advance: transposed, (s, s),
        (m, s) and (ports, s). look: transposed, (s, rows), (m, rows), (ports, rows); rows begin with the ports'
        positions, velocities and accelerations. per_newton: (ports, 3), what 1 N adds to those by a step's end (and
        to the acceleration at once). command: (n, m), or (n steps, m).
        """
        looked, forces = out
        n, ports, rows, size = looked.shape[0], per_newton.shape[0], looked.shape[1], state.shape[0]
        fine = command.shape[0] == n * steps and steps > 1
        free, before, force = np.empty(size), np.zeros(command.shape[1]), np.zeros(ports)
        at, seen, seen_free = np.zeros(LENGTH), np.empty(rows), np.empty(rows)
        at[STEP_S] = step_s
        for k in range(n):
            seen[:] = 0.0
            _add(seen, look[0], state)
            _add(seen, look[1], before)
            _add(seen, look[2], force)
            looked[k] = seen
            forces[k] = force
            for step in range(steps):
                u = command[k * steps + step] if fine else command[k]
                free[:] = 0.0
                _add(free, advance[0], state)
                _add(free, advance[1], u)
                if len(places):
                    seen[:] = 0.0
                    _add(seen, look[0], state)
                    _add(seen, look[1], u)
                    force[:] = 0.0
                    at[TIME_S] = (k * steps + step) * step_s
                    for item in range(places.shape[0]):
                        port = places[item, 1]
                        seen_free[:] = 0.0
                        _add(seen_free, look[0], free)
                        at[X], at[V] = seen[port], seen[ports + port]
                        at[X_FREE], at[V_FREE] = seen_free[port], seen_free[ports + port]
                        at[X_PER_N], at[V_PER_N] = per_newton[port, 0], per_newton[port, 1]
                        at[A_FREE] = seen[2 * ports + port]
                        at[A_PER_N] = per_newton[port, 2]
                        added = laws[places[item, 0]](
                            of[places[item, 2] : places[item, 3]], memory[places[item, 4] : places[item, 5]], at
                        )
                        force[port] += added
                        for i in range(size):
                            free[i] += advance[2][port, i] * added
                        for i in range(rows):
                            seen[i] += look[2][port, i] * added
                state[:] = free
                before[:] = u
