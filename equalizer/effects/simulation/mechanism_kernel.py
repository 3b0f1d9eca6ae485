"""Compiled time stepping of a linear structure under commands and forces that depend on the motion.

The linear part is exact (matrix exponential, see `stepping`). A motion-dependent force is held over a step and solved
for implicitly by its law, from the motion at the step's end (see `instant`); several forces by Gauss-Seidel sweeps.
"""

import warnings
from collections.abc import Callable
from functools import cache
from typing import Any

import numpy as np
import numpy.typing as npt
from numba import njit, types
from numba.core.errors import NumbaExperimentalFeatureWarning

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
from equalizer.effects.simulation.linear_step_kernel import FAST, advance_state
from equalizer.laws.kernel import NO_REFERENCE_COUNTS
from equalizer.signals.signal import FloatArray

# Laws are passed as function values, so that a changed law is never run from a stale cached kernel; numba warns that
# this feature is experimental. The filter is set once for the process, because `catch_warnings` is not thread-safe.
warnings.filterwarnings("ignore", category=NumbaExperimentalFeatureWarning)

MAX_LAWS = 6
"""Largest number of different laws that can act at once."""
MAX_SWEEPS = 12
"""Largest number of Gauss-Seidel sweeps per step over several forces: each is solved again with the newest values of
the others."""
FORCE_TOLERANCE = 1e-7
"""Tolerance of the sweeps: relative change of a force below which the others are not solved again. The motion then
differs by at most 1e-6 (relative) from the converged motion, for a joint with friction and an axis with friction."""
FORCE_ROWS = 4
"""Rows of the table of forces: mean over the step, mean over the step before, force at the step's end, and whether the
force is to be solved again because another force has changed (1 or 0)."""
_MEAN, _MEAN_BEFORE, _END, _STALE = range(FORCE_ROWS)
_VECTOR = types.float64[::1]
_MATRIX = types.float64[:, ::1]
READ_ONLY = types.Array(types.float64, 2, "C", readonly=True)
_TABLE = types.int64[:, ::1]
LAW = types.float64(_VECTOR, _VECTOR, _VECTOR)
"""Signature that every force law is compiled with."""

Integers = npt.NDArray[np.int64]
StepMatrices = tuple[FloatArray, FloatArray, FloatArray, FloatArray]

_MATRICES = types.UniTuple(_MATRIX, 4)  # type: ignore[no-untyped-call]
_LAWS = types.UniTuple(types.FunctionType(LAW), MAX_LAWS)  # type: ignore[no-untyped-call]
_COUNT = types.UniTuple(types.int64, 3)  # type: ignore[no-untyped-call]
_NOW_X, _NOW_V, _NEXT_X, _NEXT_V, _A, _FORCE, _FORCE_END = range(7)
PORT_ROWS = 7
"""Rows of the port table: position and velocity at a step's start and, predicted, at its end; acceleration at its start
without forces; forces over the step and at its end."""


def compile_law(law: Callable[[FloatArray, FloatArray, FloatArray], float]) -> Any:
    """The law, compiled for calls from the kernel. numba caches its machine code next to the file that defines the
    law."""
    return njit(LAW, cache=True, error_model="numpy", **NO_REFERENCE_COUNTS)(law)


class LawAddress(types.WrapperAddressProtocol):
    """A compiled law as argument of a kernel. Its address is looked up once; numba would do so in every call, which
    takes five times as long as the rest of the call."""

    def __init__(self, law: Any) -> None:
        result = law.get_compile_result(LAW)
        self._law = law
        self._address: int = result.library.get_pointer_to_function(result.fndesc.llvm_cfunc_wrapper_name)

    def __wrapper_address__(self) -> int:
        """Address of the compiled function, for numba."""
        return self._address

    def signature(self) -> Any:
        """Signature of the compiled function, for numba."""
        return LAW


@cache
def law_address(law: Any) -> LawAddress:
    """Address of a law that `compile_law` compiled; each law is looked up once per process."""
    return LawAddress(law)


@njit(inline="always")
def _predict_ports(output: FloatArray, state: FloatArray, ports: FloatArray) -> None:
    """Positions and velocities at the step's end without forces. output: (2 r, s)"""
    count = ports.shape[1]
    for port in range(count):
        x = v = 0.0
        for i in range(state.shape[0]):
            x += output[port, i] * state[i]
            v += output[count + port, i] * state[i]
        ports[_NEXT_X, port], ports[_NEXT_V, port] = x, v
        ports[_FORCE, port] = ports[_FORCE_END, port] = 0.0


@njit(inline="always")
def _apply_forces(force_effects: FloatArray, state: FloatArray, ports: FloatArray) -> None:
    """Add the forces' effect to the state, and move the ports to the step's end. force_effects: (r, s)"""
    for port in range(ports.shape[1]):
        ports[_NOW_X, port], ports[_NOW_V, port] = ports[_NEXT_X, port], ports[_NEXT_V, port]
        force = ports[_FORCE, port]
        for i in range(state.shape[0]):
            state[i] += force_effects[port, i] * force


@njit(inline="always")
def _store_row(state: FloatArray, ports: FloatArray, row: FloatArray) -> None:
    """Write the state (s,) and the forces (r,) at this instant into a row."""
    for i in range(state.shape[0]):
        row[i] = state[i]
    for port in range(ports.shape[1]):
        row[state.shape[0] + port] = ports[_FORCE_END, port]


@njit(inline="always")
def _predict_accelerations(output: FloatArray, added: FloatArray, state: FloatArray, ports: FloatArray) -> None:
    """Accelerations at the step's start without forces. output: (3 r, s). added: (s + r), the last r by commands."""
    count = ports.shape[1]
    for port in range(count):
        total = added[state.shape[0] + port]
        for i in range(state.shape[0]):
            total += output[2 * count + port, i] * state[i]
        ports[_A, port] = total


@njit(inline="always")
def _add_force(per_newton: FloatArray, port: int, mean: float, end: float, ports: FloatArray) -> None:
    """Add a force at a port. per_newton: (r, 3 r), what 1 N at a port adds to all positions, velocities and
    accelerations."""
    count = ports.shape[1]
    ports[_FORCE, port] += mean
    ports[_FORCE_END, port] += end
    for target in range(count):
        ports[_NEXT_X, target] += per_newton[port, target] * mean
        ports[_NEXT_V, target] += per_newton[port, count + target] * mean
        ports[_A, target] += per_newton[port, 2 * count + target] * mean


@njit(inline="always")
def _write_axis_blocks(per_newton: FloatArray, port: int, ports: FloatArray, at: FloatArray) -> None:
    """Write the motion of all ports into `at`, for the force at one of them."""
    count = ports.shape[1]
    for axis in range(count):
        block = LENGTH + BLOCK_SIZE * axis
        at[block + AXIS_X], at[block + AXIS_V] = ports[_NOW_X, axis], ports[_NOW_V, axis]
        at[block + AXIS_X_END], at[block + AXIS_V_END] = ports[_NEXT_X, axis], ports[_NEXT_V, axis]
        at[block + AXIS_X_PER_N] = per_newton[port, axis]
        at[block + AXIS_V_PER_N] = per_newton[port, count + axis]
        at[block + AXIS_A], at[block + AXIS_A_PER_N] = ports[_A, axis], per_newton[port, 2 * count + axis]


@compile_law
def no_force(parameters: FloatArray, memory: FloatArray, at: FloatArray) -> float:
    """Law without force (0 N), which fills the unused ones of the kernel's `MAX_LAWS` arguments."""
    return 0.0


@njit(inline="always")
def _solve_force(  # noqa: PLR0913 - a kernel takes flat arrays
    law: Any, parameters: FloatArray, memory: FloatArray, port: int, per_newton: FloatArray, ports: FloatArray,
    at: FloatArray,
) -> tuple[float, float]:  # fmt: skip
    """Solve for one force with all others held, and add it to the ports: its mean over the step, and its end value."""
    count = ports.shape[1]
    at[X], at[V] = ports[_NOW_X, port], ports[_NOW_V, port]
    at[X_FREE], at[V_FREE] = ports[_NEXT_X, port], ports[_NEXT_V, port]
    at[X_PER_N], at[V_PER_N] = per_newton[port, port], per_newton[port, count + port]
    at[A_FREE], at[A_PER_N] = ports[_A, port], per_newton[port, 2 * count + port]
    at[F_END] = np.nan
    if at.shape[0] > LENGTH:
        _write_axis_blocks(per_newton, port, ports, at)
    mean = law(parameters, memory, at)
    end = mean if np.isnan(at[F_END]) else at[F_END]
    _add_force(per_newton, port, mean, end, ports)
    return mean, end


@njit(
    types.void(_LAWS, _TABLE, _VECTOR, _VECTOR, _MATRIX, _MATRIX, _MATRIX, _VECTOR, _VECTOR),
    cache=True, nogil=True, error_model="numpy", fastmath=FAST, **NO_REFERENCE_COUNTS,
)  # fmt: skip
def _solve_forces(  # noqa: PLR0913 - a kernel takes flat arrays
    laws: Any, table: Integers, parameters: FloatArray, memory: FloatArray, per_newton: FloatArray, ports: FloatArray,
    forces: FloatArray, at: FloatArray, memory_before: FloatArray,
) -> None:  # fmt: skip
    """Solve for several forces in turn (Gauss-Seidel), extrapolating their means over the last two steps. A force
    is solved again only if another has changed. forces: (FORCE_ROWS, items); memory_before: work space, as memory."""
    for i in range(memory.shape[0]):
        memory_before[i] = memory[i]
    for item in range(table.shape[0]):
        mean = forces[_MEAN, item]
        forces[_MEAN, item] += mean - forces[_MEAN_BEFORE, item]
        forces[_MEAN_BEFORE, item], forces[_END, item], forces[_STALE, item] = mean, 0.0, 1.0
        _add_force(per_newton, table[item, 1], forces[_MEAN, item], 0.0, ports)
    for sweep in range(MAX_SWEEPS):
        for item in range(table.shape[0]):
            if forces[_STALE, item] == 0.0:
                continue
            port, memory_start, memory_end, mean = table[item, 1], table[item, 4], table[item, 5], forces[_MEAN, item]
            _add_force(per_newton, port, -mean, -forces[_END, item], ports)
            if sweep > 0:
                for i in range(memory_start, memory_end):
                    memory[i] = memory_before[i]
            parameter_start, law = table[item, 2], laws[table[item, 0]]
            forces[_MEAN, item], forces[_END, item] = _solve_force(
                law,
                parameters[parameter_start : table[item, 3]],
                memory[memory_start:memory_end],
                port,
                per_newton,
                ports,
                at,
            )
            if not abs(forces[_MEAN, item] - mean) <= FORCE_TOLERANCE * abs(mean):
                for force_index in range(table.shape[0]):
                    forces[_STALE, force_index] = 1.0
            forces[_STALE, item] = 0.0


@njit(
    types.void(
        _LAWS, _TABLE, _VECTOR, _VECTOR, _MATRICES, _MATRIX, READ_ONLY, _MATRIX, _VECTOR, _COUNT, types.float64,
        _VECTOR, _VECTOR, _MATRIX, _VECTOR,
    ),
    cache=True, nogil=True, error_model="numpy", fastmath=FAST, **NO_REFERENCE_COUNTS,
)  # fmt: skip
def step_mechanism(  # noqa: PLR0913 - a kernel takes flat arrays
    laws: Any, table: Integers, parameters: FloatArray, memory: FloatArray, step: StepMatrices, rows: FloatArray,
    commands: FloatArray, ports: FloatArray, state: FloatArray, count: tuple[int, int, int], step_s: float,
    added: FloatArray, at: FloatArray, forces: FloatArray, memory_before: FloatArray,
) -> None:  # fmt: skip
    """Motion under commands and motion-dependent forces; rows, ports and state are overwritten.

    rows: (n stride, s + r ...), contribution of the commands to the state over a step and to the ports' accelerations
    at its start; a sample's first row becomes the state before it and the forces (r,) at that instant. commands: (n
    stride, m), or (0, 0) where no law reads them. ports: (PORT_ROWS, r) and state: (s,) become those of the end.

    table: (items, 6) law, port, begin and end in `parameters`, begin and end in `memory`. step: matrix that advances
    the state; output matrix of the ports' positions and velocities (2 r, s), with accelerations (3 r, s) where a law
    reads them; effect of the forces on the state (r, s); and `per_newton`. count: steps per sample; stride (1 where
    commands are held over all steps, else the number of steps); number of the first sample.

    added (s + r,), at (LENGTH or more,), forces (FORCE_ROWS, items), memory_before (like memory): work space of the
    caller; `forces` keeps the forces from block to block.
    """
    advance, output, force_effects, per_newton = step
    steps, stride, first_sample = count
    states, r = state.shape[0], ports.shape[1]
    law = laws[table[0, 0]]
    law_parameters, law_memory = parameters[table[0, 2] : table[0, 3]], memory[table[0, 4] : table[0, 5]]
    at[STEP_S] = step_s
    for port in range(r):
        ports[_A, port] = np.nan
    for k in range(rows.shape[0] // stride):
        for step_index in range(steps):
            if step_index == 0 or stride > 1:
                for i in range(states + r):
                    added[i] = rows[k * stride + step_index, i]
                for axis in range(commands.shape[1]):
                    at[LENGTH + BLOCK_SIZE * axis + AXIS_COMMAND] = commands[k * stride + step_index, axis]
            if step_index == 0:
                _store_row(state, ports, rows[k * stride])
            if output.shape[0] > 2 * r:
                _predict_accelerations(output, added, state, ports)
            advance_state(advance, added, state)
            _predict_ports(output, state, ports)
            at[TIME_S] = ((first_sample + k) * steps + step_index) * step_s
            if table.shape[0] == 1:
                _solve_force(law, law_parameters, law_memory, table[0, 1], per_newton, ports, at)
            else:
                _solve_forces(laws, table, parameters, memory, per_newton, ports, forces, at, memory_before)
            _apply_forces(force_effects, state, ports)
