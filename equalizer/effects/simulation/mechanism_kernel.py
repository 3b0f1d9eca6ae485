"""Compiled time stepping of a linear structure under commands and motion-dependent forces: `step_mechanism`.

The linear part is exact (matrix exponential). A motion-dependent force is held over a step and solved for implicitly by
its law, from the motion at the step's end; several forces by Gauss-Seidel sweeps. A law reads its parameters, memory
(state variables) and `step_motion` (layout: `instant`). n samples, m commands, s states, r ports (where forces act)."""

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
from equalizer.effects.simulation.linear_step_kernel import FAST_MATH_FLAGS, advance_state
from equalizer.laws.kernel import NO_REFERENCE_COUNTS
from equalizer.signals.signal import FloatArray

# Laws are passed as function values, so that a changed law is never run from a stale cached kernel; numba warns that
# this feature is experimental. The filter is set once for the process, because `catch_warnings` is not thread-safe.
warnings.filterwarnings("ignore", category=NumbaExperimentalFeatureWarning)

MAX_LAWS = 6
"""Largest number of different laws that can act at once."""
MAX_SWEEPS = 12
"""Largest number of Gauss-Seidel sweeps per step over several forces, each with the newest values of the others."""
FORCE_TOLERANCE = 1e-7
"""Tolerance of the sweeps: relative change of a force below which the others are not solved again. The motion then
differs by at most 1e-6 (relative) from the converged motion, for a joint with friction and an axis with friction."""
FORCE_ROWS = 4
"""Rows of the array `forces`, in N: mean over the step, mean over the previous step, force at the step's end; and
whether the force is to be solved again because another force has changed (1 or 0)."""
_MEAN, _PREVIOUS_MEAN, _END, _STALE = range(FORCE_ROWS)
_VECTOR = types.float64[::1]
_MATRIX = types.float64[:, ::1]
READ_ONLY_MATRIX = types.Array(types.float64, 2, "C", readonly=True)
_INT_MATRIX = types.int64[:, ::1]
"""numba types of contiguous arrays; a kernel may write to all but READ_ONLY_MATRIX."""
LAW = types.float64(_VECTOR, _VECTOR, _VECTOR)
"""Signature that every force law is compiled with."""

Integers = npt.NDArray[np.int64]
StepMatrices = tuple[FloatArray, FloatArray, FloatArray, FloatArray]
"""The four matrices of the argument `step` of `step_mechanism`."""

_MATRICES = types.UniTuple(_MATRIX, 4)  # type: ignore[no-untyped-call]
_LAWS = types.UniTuple(types.FunctionType(LAW), MAX_LAWS)  # type: ignore[no-untyped-call]
_COUNTS = types.UniTuple(types.int64, 3)  # type: ignore[no-untyped-call]
_NOW_X, _NOW_V, _NEXT_X, _NEXT_V, _A, _FORCE, _FORCE_END = range(7)
PORT_ROWS = 7
"""Rows of the port table: position and velocity at a step's start and, predicted, at its end; acceleration at its
start, to which the forces add; forces over the step and at its end."""


def compile_law(law: Callable[[FloatArray, FloatArray, FloatArray], float]) -> Any:
    """Compile a law for calls from the kernel; numba caches the machine code next to the law's module."""
    return njit(LAW, cache=True, error_model="numpy", **NO_REFERENCE_COUNTS)(law)


class LawAddress(types.WrapperAddressProtocol):
    """A compiled law as argument of a kernel. Its address is looked up once; numba's own lookup in every call takes
    five times as long as the rest of the call."""

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
def wrap_law(law: Any) -> LawAddress:
    """Wrap a law that `compile_law` compiled, as argument of a kernel; each law is looked up once per process."""
    return LawAddress(law)


@njit(inline="always")
def _predict_ports(output: FloatArray, state: FloatArray, ports: FloatArray) -> None:
    """Predict the ports' motion at the step's end without forces, and zero their forces. output: (2 r or more, s)."""
    port_count = ports.shape[1]
    for port in range(port_count):
        x = v = 0.0
        for i in range(state.shape[0]):
            x += output[port, i] * state[i]
            v += output[port_count + port, i] * state[i]
        ports[_NEXT_X, port], ports[_NEXT_V, port] = x, v
        ports[_FORCE, port] = ports[_FORCE_END, port] = 0.0


@njit(inline="always")
def _apply_forces(force_effects: FloatArray, state: FloatArray, ports: FloatArray) -> None:
    """Add the forces' effect to the state, and move the ports to the step's end. force_effects: (r, s), per newton."""
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
def _predict_accelerations(output: FloatArray, contribution: FloatArray, state: FloatArray, ports: FloatArray) -> None:
    """Predict accelerations at the step's start without forces. output: (3 r, s); contribution: (s + r,)."""
    port_count = ports.shape[1]
    for port in range(port_count):
        acceleration = contribution[state.shape[0] + port]
        for i in range(state.shape[0]):
            acceleration += output[2 * port_count + port, i] * state[i]
        ports[_A, port] = acceleration


@njit(inline="always")
def _add_force(per_newton: FloatArray, port: int, mean: float, end: float, ports: FloatArray) -> None:
    """Add a force (N) to its port, and its effect to the motion of all ports. per_newton: (r, 3 r), change of all
    positions, velocities and accelerations by 1 N at each port."""
    port_count = ports.shape[1]
    ports[_FORCE, port] += mean
    ports[_FORCE_END, port] += end
    for other_port in range(port_count):
        ports[_NEXT_X, other_port] += per_newton[port, other_port] * mean
        ports[_NEXT_V, other_port] += per_newton[port, port_count + other_port] * mean
        ports[_A, other_port] += per_newton[port, 2 * port_count + other_port] * mean


@njit(inline="always")
def _write_axis_blocks(per_newton: FloatArray, port: int, ports: FloatArray, step_motion: FloatArray) -> None:
    """Write the motion of all ports into `step_motion`, for the force at one of them."""
    r = ports.shape[1]
    for axis in range(r):
        block = LENGTH + BLOCK_SIZE * axis
        step_motion[block + AXIS_X], step_motion[block + AXIS_V] = ports[_NOW_X, axis], ports[_NOW_V, axis]
        step_motion[block + AXIS_X_END], step_motion[block + AXIS_V_END] = ports[_NEXT_X, axis], ports[_NEXT_V, axis]
        step_motion[block + AXIS_X_PER_N] = per_newton[port, axis]
        step_motion[block + AXIS_V_PER_N] = per_newton[port, r + axis]
        step_motion[block + AXIS_A], step_motion[block + AXIS_A_PER_N] = ports[_A, axis], per_newton[port, 2 * r + axis]


@compile_law
def compute_zero_force(parameters: FloatArray, memory: FloatArray, step_motion: FloatArray) -> float:
    """Return 0 N: the law that fills the unused of the kernel's `MAX_LAWS` arguments."""
    return 0.0


@njit(inline="always")
def _solve_force(  # noqa: PLR0913 - a kernel takes flat arrays
    law: Any, parameters: FloatArray, memory: FloatArray, port: int, per_newton: FloatArray, ports: FloatArray,
    step_motion: FloatArray,
) -> tuple[float, float]:  # fmt: skip
    """Solve for one force with all others held, and add it to the ports. Returns its step mean and end value (N)."""
    port_count = ports.shape[1]
    step_motion[X], step_motion[V] = ports[_NOW_X, port], ports[_NOW_V, port]
    step_motion[X_FREE], step_motion[V_FREE] = ports[_NEXT_X, port], ports[_NEXT_V, port]
    step_motion[X_PER_N], step_motion[V_PER_N] = per_newton[port, port], per_newton[port, port_count + port]
    step_motion[A_FREE], step_motion[A_PER_N] = ports[_A, port], per_newton[port, 2 * port_count + port]
    step_motion[F_END] = np.nan
    if step_motion.shape[0] > LENGTH:
        _write_axis_blocks(per_newton, port, ports, step_motion)
    mean = law(parameters, memory, step_motion)
    end = mean if np.isnan(step_motion[F_END]) else step_motion[F_END]
    _add_force(per_newton, port, mean, end, ports)
    return mean, end


@njit(
    types.void(_LAWS, _INT_MATRIX, _VECTOR, _VECTOR, _MATRIX, _MATRIX, _MATRIX, _VECTOR, _VECTOR),
    cache=True, nogil=True, error_model="numpy", fastmath=FAST_MATH_FLAGS, **NO_REFERENCE_COUNTS,
)  # fmt: skip
def _solve_forces(  # noqa: PLR0913 - a kernel takes flat arrays
    laws: Any, table: Integers, parameters: FloatArray, memory: FloatArray, per_newton: FloatArray, ports: FloatArray,
    forces: FloatArray, step_motion: FloatArray, start_memory: FloatArray,
) -> None:  # fmt: skip
    """Solve for several forces in turn (Gauss-Seidel), starting from linear extrapolation over the last two steps. A
    force is solved again if another changes by more than the tolerance. Arguments: see `step_mechanism`."""
    for i in range(memory.shape[0]):
        start_memory[i] = memory[i]
    for row in range(table.shape[0]):
        mean = forces[_MEAN, row]
        forces[_MEAN, row] += mean - forces[_PREVIOUS_MEAN, row]
        forces[_PREVIOUS_MEAN, row], forces[_END, row], forces[_STALE, row] = mean, 0.0, 1.0
        _add_force(per_newton, table[row, 1], forces[_MEAN, row], 0.0, ports)
    for sweep in range(MAX_SWEEPS):
        for row in range(table.shape[0]):
            if forces[_STALE, row] == 0.0:
                continue
            port, memory_start, memory_end, mean = table[row, 1], table[row, 4], table[row, 5], forces[_MEAN, row]
            _add_force(per_newton, port, -mean, -forces[_END, row], ports)
            if sweep > 0:
                for i in range(memory_start, memory_end):
                    memory[i] = start_memory[i]
            parameter_start, law = table[row, 2], laws[table[row, 0]]
            forces[_MEAN, row], forces[_END, row] = _solve_force(
                law,
                parameters[parameter_start : table[row, 3]],
                memory[memory_start:memory_end],
                port,
                per_newton,
                ports,
                step_motion,
            )
            if not abs(forces[_MEAN, row] - mean) <= FORCE_TOLERANCE * abs(mean):
                for other_row in range(table.shape[0]):
                    forces[_STALE, other_row] = 1.0
            forces[_STALE, row] = 0.0


@njit(
    types.void(
        _LAWS, _INT_MATRIX, _VECTOR, _VECTOR, _MATRICES, _MATRIX, READ_ONLY_MATRIX, _MATRIX, _VECTOR, _COUNTS,
        types.float64, _VECTOR, _VECTOR, _MATRIX, _VECTOR,
    ),
    cache=True, nogil=True, error_model="numpy", fastmath=FAST_MATH_FLAGS, **NO_REFERENCE_COUNTS,
)  # fmt: skip
def step_mechanism(  # noqa: PLR0913 - a kernel takes flat arrays
    laws: Any, table: Integers, parameters: FloatArray, memory: FloatArray, step: StepMatrices, rows: FloatArray,
    commands: FloatArray, ports: FloatArray, state: FloatArray, counts: tuple[int, int, int], step_s: float,
    contribution: FloatArray, step_motion: FloatArray, forces: FloatArray, start_memory: FloatArray,
) -> None:  # fmt: skip
    """Simulate n samples under commands and motion-dependent forces, in place.

    rows: (n stride, s + r or more), contributions of the commands to the state over a step and to the ports'
    accelerations at its start; on return, the first row of each sample holds the state (s,) and the forces (r,) just
    before it. commands: (n stride, m), or (0, 0) where no law reads them. ports (PORT_ROWS, r), state (s,) and memory:
    on return, the values at the end.
    table: (number of forces, 6), per force the indices of law and port, its range in `parameters` and in `memory`.
    step: matrix that advances the state; output matrix of the ports' positions and velocities (2 r, s), with
    accelerations (3 r, s) where a law reads them; effect of the forces on the state (r, s); and `per_newton`.
    counts: steps per sample; stride (1 where commands are held over all steps, else the number of steps); number of
    the first sample.
    contribution (s + r,), step_motion (LENGTH or more,), start_memory (as memory): work space; forces (FORCE_ROWS,
    number of forces): kept by the caller from block to block.
    """
    advance, output, force_effects, per_newton = step
    steps, stride, first_sample = counts
    state_count, port_count = state.shape[0], ports.shape[1]
    law = laws[table[0, 0]]
    law_parameters, law_memory = parameters[table[0, 2] : table[0, 3]], memory[table[0, 4] : table[0, 5]]
    step_motion[STEP_S] = step_s
    for port in range(port_count):
        ports[_A, port] = np.nan
    for sample in range(rows.shape[0] // stride):
        for substep in range(steps):
            if substep == 0 or stride > 1:
                for i in range(state_count + port_count):
                    contribution[i] = rows[sample * stride + substep, i]
                for axis in range(commands.shape[1]):
                    step_motion[LENGTH + BLOCK_SIZE * axis + AXIS_COMMAND] = commands[sample * stride + substep, axis]
            if substep == 0:
                _store_row(state, ports, rows[sample * stride])
            if output.shape[0] > 2 * port_count:
                _predict_accelerations(output, contribution, state, ports)
            advance_state(advance, contribution, state)
            _predict_ports(output, state, ports)
            step_motion[TIME_S] = ((first_sample + sample) * steps + substep) * step_s
            if table.shape[0] == 1:
                _solve_force(law, law_parameters, law_memory, table[0, 1], per_newton, ports, step_motion)
            else:
                _solve_forces(laws, table, parameters, memory, per_newton, ports, forces, step_motion, start_memory)
            _apply_forces(force_effects, state, ports)
