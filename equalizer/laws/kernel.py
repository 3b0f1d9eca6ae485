"""Compiled stack machine that runs a law's program (postfix code, see `program`) at an instant or along samples.

A time step has a start and an end. Between them the signals of operators with memory (lag, play, delay, integral) are
linear in time; at a start they may jump, as commands do. `run_program` may be called several times for a step;
`commit_step` then stores its end as the start of the next step. Times are in seconds.
"""

from typing import Any

import numpy as np
from numba import njit, types

from equalizer.laws.program import MAX_CELLS, MEMORY_SIZE, OPCODES, STACK_SIZE
from equalizer.signals.signal import FloatArray

START, END = 0, 1
"""Instant of a step at which a value is computed (`phase`)."""
SETTLED, STARTED, FROM_ZERO = 0.0, 1.0, 2.0
"""First number of the memory: initialization state. SETTLED: to be initialized to the steady state of the signals'
first values; FROM_ZERO: to be initialized with all signals zero; STARTED: initialized."""
NO_REFERENCE_COUNTS: Any = {"_nrt": False}
"""Numba option to compile without reference counts of arrays, safe because the caller owns all arrays and the function
allocates none. Measured: their atomic operations took two thirds of the time of a short law, and three quarters of a
step of a mechanism."""
_VECTOR = types.float64[::1]
_MATRIX = types.float64[:, ::1]
_NUMBER, _VARIABLE = OPCODES["number"], OPCODES["variable"]
_ADD, _SUBTRACT, _MULTIPLY, _DIVIDE, _POWER = (OPCODES[name] for name in ("+", "-", "*", "/", "**"))
_MINIMUM = OPCODES["minimum"]
_NEGATE, _ABS, _SIGN, _SQRT = OPCODES["neg"], OPCODES["abs"], OPCODES["sign"], OPCODES["sqrt"]
_SIN, _COS, _EXP, _LOG, _TANH, _ATAN = (OPCODES[name] for name in ("sin", "cos", "exp", "log", "tanh", "atan"))
_LAG, _PLAY, _DELAY, _INTEGRAL = (OPCODES[name] for name in ("lag", "play", "delay", "integral"))
_TIME_TOLERANCE = 1e-9
"""Tolerance for equal instants, relative to the delay, for rounding. Chosen."""
_RING_SIZE = (MEMORY_SIZE["delay"] - 4) // 2
"""Number of instants that the ring buffer of a delay can store."""


@njit(inline="always")
def _apply_binary(code: int, left: float, right: float) -> float:
    """Apply an operator with two arguments; minimum and maximum return NaN if an argument is NaN."""
    if code == _MULTIPLY:
        return left * right
    if code == _ADD:
        return left + right
    if code == _SUBTRACT:
        return left - right
    if code == _DIVIDE:
        return left / right
    if code == _POWER:
        return left * left if right == 2.0 else left**right
    if code == _MINIMUM:
        return right if right < left or np.isnan(right) else left
    return right if right > left or np.isnan(right) else left


@njit(inline="always")
def _apply_unary(code: int, operand: float) -> float:  # noqa: C901 - a table, in the only form that compiles to a jump
    """Apply a function of one argument; NaN or inf outside its domain."""
    if code == _NEGATE:
        return -operand
    if code == _ABS:
        return abs(operand)
    if code == _SIGN:
        return float(np.sign(operand))
    if code == _TANH:
        return float(np.tanh(operand))
    if code == _SIN:
        return float(np.sin(operand))
    if code == _COS:
        return float(np.cos(operand))
    if code == _EXP:
        return float(np.exp(operand))
    if code == _LOG:
        return float(np.log(operand))
    if code == _SQRT:
        return float(np.sqrt(operand))
    if code == _ATAN:
        return float(np.arctan(operand))
    return float(np.tan(operand))


@njit(inline="always")
def _apply_lag(signal: float, tau_s: float, memory: FloatArray, offset: int, phase: int, step_s: float) -> float:
    """Compute a first-order lag, y' = (s - y) / tau, exact for signals s that are linear over a step; s itself where
    tau is not above 0. memory: y and s at the start, then y and s at the end."""
    if not tau_s > 0:
        return signal
    if phase == START:
        memory[offset + 1] = signal
        return float(memory[offset])
    step_ratio = step_s / tau_s
    rise = -np.expm1(-step_ratio)
    mean_decay = rise / step_ratio
    memory[offset + 2] = (
        (1 - rise) * memory[offset] + (mean_decay - 1 + rise) * memory[offset + 1] + (1 - mean_decay) * signal
    )
    memory[offset + 3] = signal
    return float(memory[offset + 2])


@njit(inline="always")
def _apply_integral(signal: float, memory: FloatArray, offset: int, phase: int, step_s: float) -> float:
    """Compute the integral over time by the trapezoidal rule, exact for linear signals. memory: value and signal at the
    start, then at the end."""
    if phase == START:
        memory[offset + 1] = signal
        return float(memory[offset])
    memory[offset + 2] = memory[offset] + 0.5 * step_s * (memory[offset + 1] + signal)
    memory[offset + 3] = signal
    return float(memory[offset + 2])


@njit(inline="always")
def _apply_play(signal: float, half_width: float, memory: FloatArray, offset: int, phase: int) -> float:
    """Compute the play (backlash) operator: the output moves only as far as needed to stay within half_width of the
    signal. memory: output at the start, at the end."""
    width = max(half_width, 0.0)
    output = min(max(memory[offset], signal - width), signal + width)
    memory[offset + 1] = output
    if phase == START:
        memory[offset] = output
    return float(output)


@njit(
    types.float64(types.float64, types.float64, _VECTOR, types.int64, types.int64, types.float64),
    cache=True, nogil=True, **NO_REFERENCE_COUNTS,
)  # fmt: skip
def _interpolate_delayed(
    signal: float, delay_s: float, memory: FloatArray, offset: int, phase: int, time_s: float
) -> float:
    """Interpolate the signal at time_s - delay_s linearly in the ring buffer. memory: number of instants written,
    index of the oldest in use, their times and values; then the latest signal and delay, which are not yet in the
    buffer. At a jump of the signal, the start of a step reads the value after it, the end the value before it."""
    times, values, delayed_s = offset + 2, offset + 2 + _RING_SIZE, time_s - delay_s
    oldest, newest = int(memory[offset + 1]), int(memory[offset]) - 1
    limit_s = delayed_s + (_TIME_TOLERANCE if phase == START else -_TIME_TOLERANCE) * delay_s
    while oldest < newest and memory[times + (oldest + 1) % _RING_SIZE] <= limit_s:
        oldest += 1
    time_before, value_before = memory[times + oldest % _RING_SIZE], memory[values + oldest % _RING_SIZE]
    time_after, value_after = time_s, signal
    if oldest < newest:
        time_after, value_after = memory[times + (oldest + 1) % _RING_SIZE], memory[values + (oldest + 1) % _RING_SIZE]
    if time_after <= time_before:
        return float(value_before)
    return float(
        value_before
        + (value_after - value_before) * min(max((delayed_s - time_before) / (time_after - time_before), 0.0), 1.0)
    )


@njit(
    types.void(types.float64, types.float64, _VECTOR, types.int64, types.float64),
    cache=True,
    nogil=True,
    **NO_REFERENCE_COUNTS,
)
def _store_instant(signal: float, delay_s: float, memory: FloatArray, offset: int, time_s: float) -> None:
    """Append an instant to the ring buffer; replace the newest instant while it is too close to its predecessor."""
    times, values, count = offset + 2, offset + 2 + _RING_SIZE, int(memory[offset])
    if count < 2 or time_s - memory[times + (count - 2) % _RING_SIZE] >= delay_s / MAX_CELLS * (1 - _TIME_TOLERANCE):
        count += 1
    memory[offset], memory[times + (count - 1) % _RING_SIZE], memory[values + (count - 1) % _RING_SIZE] = (
        count,
        time_s,
        signal,
    )
    oldest = int(memory[offset + 1])
    while oldest < count - 1 and memory[times + (oldest + 1) % _RING_SIZE] <= time_s - (1 + _TIME_TOLERANCE) * delay_s:
        oldest += 1
    memory[offset + 1] = max(oldest, count - _RING_SIZE)


@njit(inline="always")
def _apply_delay(signal: float, delay_s: float, memory: FloatArray, offset: int, phase: int, time_s: float) -> float:
    """Delay a signal by delay_s seconds, none where it is not above 0; a jump at the start of a step is stored as a
    second instant of the same time."""
    if not delay_s > 0:
        return signal
    newest = offset + 2 + _RING_SIZE + (int(memory[offset]) - 1) % _RING_SIZE
    if phase == START and memory[newest] != signal:
        _store_instant(signal, delay_s, memory, offset, time_s)
    memory[offset + 2 + 2 * _RING_SIZE], memory[offset + 3 + 2 * _RING_SIZE] = signal, delay_s
    return float(_interpolate_delayed(signal, delay_s, memory, offset, phase, time_s))


@njit(inline="always")
def _initialise_memory(code: int, signal: float, memory: FloatArray, offset: int, time_s: float) -> None:
    """Initialize an operator's memory to the steady state of a constant signal; an integral stays at its value."""
    if code == _DELAY:
        memory[offset], memory[offset + 1], memory[offset + 2], memory[offset + 2 + _RING_SIZE] = (
            1.0,
            0.0,
            time_s,
            signal,
        )
    elif code != _INTEGRAL:
        memory[offset] = signal


@njit(inline="always")
def _run_with_memory(  # noqa: PLR0913 - a kernel takes flat arrays
    code: int,
    signal: float,
    parameter: float,
    memory: FloatArray,
    offset: int,
    phase: int,
    time_s: float,
    step_s: float,
) -> float:
    """Compute an operator with memory. parameter: its second, constant argument (unused by the integral); offset:
    index of its first cell in `memory`."""
    if memory[0] != STARTED:
        _initialise_memory(code, 0.0 if memory[0] == FROM_ZERO else signal, memory, offset, time_s)
    if code == _LAG:
        return float(_apply_lag(signal, parameter, memory, offset, phase, step_s))
    if code == _PLAY:
        return float(_apply_play(signal, parameter, memory, offset, phase))
    if code == _DELAY:
        return float(_apply_delay(signal, parameter, memory, offset, phase, time_s))
    return float(_apply_integral(signal, memory, offset, phase, step_s))


@njit(
    types.float64(_VECTOR, _VECTOR, _VECTOR, _VECTOR, types.int64, types.float64, types.float64),
    cache=True, nogil=True, error_model="numpy", **NO_REFERENCE_COUNTS,
)  # fmt: skip
def run_program(  # noqa: PLR0913 - a kernel takes flat arrays
    program: FloatArray, signals: FloatArray, memory: FloatArray, stack: FloatArray, phase: int, time_s: float,
    step_s: float,
) -> float:  # fmt: skip
    """Compute the law's value at a step's start or end (`phase`). program: (2 k,), code and operand in turn; signals:
    (columns,), at this instant; time_s: time of this instant; stack: (STACK_SIZE,), work space."""
    top = -1
    for row in range(0, program.shape[0], 2):
        code = int(program[row])
        if code == _NUMBER:
            top += 1
            stack[top] = program[row + 1]
        elif code == _VARIABLE:
            top += 1
            stack[top] = signals[int(program[row + 1])]
        elif code < _NEGATE:
            top -= 1
            stack[top] = _apply_binary(code, stack[top], stack[top + 1])
        elif code < _LAG:
            stack[top] = _apply_unary(code, stack[top])
        else:
            top -= code != _INTEGRAL
            stack[top] = _run_with_memory(
                code, stack[top], stack[top + 1], memory, int(program[row + 1]), phase, time_s, step_s
            )
    return float(stack[0])


@njit(types.void(_VECTOR, _VECTOR, types.float64), cache=True, nogil=True, **NO_REFERENCE_COUNTS)
def commit_step(program: FloatArray, memory: FloatArray, time_s: float) -> None:
    """Store the end of the last step as the start of the next step. time_s: time of that end."""
    for row in range(0, program.shape[0], 2):
        code, offset = int(program[row]), int(program[row + 1])
        if code in (_LAG, _INTEGRAL):
            memory[offset], memory[offset + 1] = memory[offset + 2], memory[offset + 3]
        elif code == _PLAY:
            memory[offset] = memory[offset + 1]
        elif code == _DELAY and memory[offset + 3 + 2 * _RING_SIZE] > 0:
            _store_instant(
                memory[offset + 2 + 2 * _RING_SIZE], memory[offset + 3 + 2 * _RING_SIZE], memory, offset, time_s
            )


@njit(types.void(_VECTOR, _MATRIX, _VECTOR, types.float64, _VECTOR), cache=True, nogil=True, error_model="numpy")
def run_interpolated(
    program: FloatArray, signals: FloatArray, memory: FloatArray, step_s: float, values: FloatArray
) -> None:
    """Write the law's values at n samples, step_s seconds apart, to `values` (n,). signals: (n, k), interpolated
    linearly between samples."""
    stack = np.empty(STACK_SIZE)
    for k in range(signals.shape[0]):
        values[k] = run_program(program, signals[k], memory, stack, END if k > 0 else START, k * step_s, step_s)
        if k > 0:
            commit_step(program, memory, k * step_s)
        memory[0] = STARTED


@njit(types.void(_VECTOR, _MATRIX, _VECTOR, types.float64, _MATRIX), cache=True, nogil=True, error_model="numpy")
def run_held(program: FloatArray, signals: FloatArray, memory: FloatArray, step_s: float, values: FloatArray) -> None:
    """Write the law's values at the start and at the end of each step to `values` (2, n); signals (n, k) are held over
    a step of step_s seconds."""
    stack = np.empty(STACK_SIZE)
    for k in range(signals.shape[0]):
        values[0, k] = run_program(program, signals[k], memory, stack, START, k * step_s, step_s)
        memory[0] = STARTED
        values[1, k] = run_program(program, signals[k], memory, stack, END, (k + 1) * step_s, step_s)
        commit_step(program, memory, (k + 1) * step_s)
