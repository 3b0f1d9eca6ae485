"""Compiled stack machine that runs a law's program (postfix code, see `program`) at an instant or along samples.

A step has a start and an end. Between them the signals of operators with memory (lag, play, delay, integral) are
straight lines; at a start they may jump, as commands do. `run` may be called several times for a step; `commit_step`
then stores its end as the start of the next step. Times are in seconds.
"""

from typing import Any

import numpy as np
from numba import njit, types

from equalizer.laws.program import CELLS, CODE, DEEPEST, KEPT
from equalizer.signals.signal import FloatArray

START, END = 0, 1
"""Phase of a step at which a value is computed."""
SETTLED, BEGUN, FROM_ZERO = 0.0, 1.0, 2.0
"""State of the memory, its first number. SETTLED: not started, begins in the steady state of the signals' first values;
BEGUN: started; FROM_ZERO: not started, begins with all signals zero."""
UNCOUNTED: Any = {"_nrt": False}
"""Option of Numba to compile without reference counts of arrays, permitted because all arrays belong to the caller and
the function allocates none. Their atomic operations took two thirds of the time of a short law, and three quarters of a
step of a mechanism."""
_VECTOR = types.float64[::1]
_MATRIX = types.float64[:, ::1]
_NUMBER, _VARIABLE = CODE["number"], CODE["variable"]
_ADD, _SUBTRACT, _MULTIPLY, _DIVIDE, _POWER = (CODE[name] for name in ("+", "-", "*", "/", "**"))
_MINIMUM = CODE["minimum"]
_NEGATE, _ABS, _SIGN, _SQRT = CODE["neg"], CODE["abs"], CODE["sign"], CODE["sqrt"]
_SIN, _COS, _EXP, _LOG, _TANH, _ATAN = (CODE[name] for name in ("sin", "cos", "exp", "log", "tanh", "atan"))
_LAG, _PLAY, _DELAY, _INTEGRAL = (CODE[name] for name in ("lag", "play", "delay", "integral"))
_SAME = 1e-9
"""Tolerance for equal instants, relative to the delay (rounding)."""
_RING = (KEPT["delay"] - 4) // 2
"""Number of instants in the ring buffer of a delay."""


@njit(inline="always")
def _binary(code: int, left: float, right: float) -> float:
    """Operator with two arguments; minimum and maximum return NaN if an argument is NaN."""
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
def _lag(signal: float, tau_s: float, memory: FloatArray, at: int, phase: int, step_s: float) -> float:
    """First-order lag, y' = (s - y) / tau, exact for signals s that are straight lines over a step. memory: y and s at
    the start, then y and s at the end."""
    if not tau_s > 0:
        return signal
    if phase == START:
        memory[at + 1] = signal
        return float(memory[at])
    steps = step_s / tau_s
    gone = -np.expm1(-steps)
    mean = gone / steps
    memory[at + 2] = (1 - gone) * memory[at] + (mean - 1 + gone) * memory[at + 1] + (1 - mean) * signal
    memory[at + 3] = signal
    return float(memory[at + 2])


@njit(inline="always")
def _integral(signal: float, memory: FloatArray, at: int, phase: int, step_s: float) -> float:
    """Integral over time by the trapezoidal rule, exact for straight lines. memory: value and signal at the start, then
    at the end."""
    if phase == START:
        memory[at + 1] = signal
        return float(memory[at])
    memory[at + 2] = memory[at] + 0.5 * step_s * (memory[at + 1] + signal)
    memory[at + 3] = signal
    return float(memory[at + 2])


@njit(inline="always")
def _apply_play(signal: float, half_width: float, memory: FloatArray, at: int, phase: int) -> float:
    """Play (backlash) operator: the output moves only as far as it takes to stay within half_width of the signal.
    memory: output at the start, at the end."""
    width = max(half_width, 0.0)
    follows = min(max(memory[at], signal - width), signal + width)
    memory[at + 1] = follows
    if phase == START:
        memory[at] = follows
    return float(follows)


@njit(
    types.float64(types.float64, types.float64, _VECTOR, types.int64, types.int64, types.float64),
    cache=True, nogil=True, **UNCOUNTED,
)  # fmt: skip
def _interpolate_delayed(
    signal: float, delay_s: float, memory: FloatArray, at: int, phase: int, time_s: float
) -> float:
    """The signal at time_s - delay_s, interpolated linearly in the ring buffer. memory: number of instants written,
    index of the oldest in use, their times and values; then the latest signal and delay, which are not yet in the
    buffer. At a jump of the signal, the start of a step reads the value after it, the end the value before it."""
    times, values, wanted = at + 2, at + 2 + _RING, time_s - delay_s
    first, last = int(memory[at + 1]), int(memory[at]) - 1
    passed = wanted + (_SAME if phase == START else -_SAME) * delay_s
    while first < last and memory[times + (first + 1) % _RING] <= passed:
        first += 1
    before_s, before = memory[times + first % _RING], memory[values + first % _RING]
    after_s, after = time_s, signal
    if first < last:
        after_s, after = memory[times + (first + 1) % _RING], memory[values + (first + 1) % _RING]
    if after_s <= before_s:
        return float(before)
    return float(before + (after - before) * min(max((wanted - before_s) / (after_s - before_s), 0.0), 1.0))


@njit(
    types.void(types.float64, types.float64, _VECTOR, types.int64, types.float64),
    cache=True,
    nogil=True,
    **UNCOUNTED,
)
def _store_instant(signal: float, delay_s: float, memory: FloatArray, at: int, time_s: float) -> None:
    """Append an instant to the ring buffer; replace the newest instant while it is too close to its predecessor."""
    times, values, count = at + 2, at + 2 + _RING, int(memory[at])
    if count < 2 or time_s - memory[times + (count - 2) % _RING] >= delay_s / CELLS * (1 - _SAME):
        count += 1
    memory[at], memory[times + (count - 1) % _RING], memory[values + (count - 1) % _RING] = count, time_s, signal
    first = int(memory[at + 1])
    while first < count - 1 and memory[times + (first + 1) % _RING] <= time_s - (1 + _SAME) * delay_s:
        first += 1
    memory[at + 1] = max(first, count - _RING)


@njit(inline="always")
def _delay(signal: float, delay_s: float, memory: FloatArray, at: int, phase: int, time_s: float) -> float:
    """Delay by delay_s seconds; a jump at the start of a step is stored as a second instant of the same time."""
    if not delay_s > 0:
        return signal
    newest = at + 2 + _RING + (int(memory[at]) - 1) % _RING
    if phase == START and memory[newest] != signal:
        _store_instant(signal, delay_s, memory, at, time_s)
    memory[at + 2 + 2 * _RING], memory[at + 3 + 2 * _RING] = signal, delay_s
    return float(_interpolate_delayed(signal, delay_s, memory, at, phase, time_s))


@njit(inline="always")
def _initialise_memory(code: int, signal: float, memory: FloatArray, at: int, time_s: float) -> None:
    """Fill an operator's memory as if its signal had always had this value."""
    if code == _DELAY:
        memory[at], memory[at + 1], memory[at + 2], memory[at + 2 + _RING] = 1.0, 0.0, time_s, signal
    elif code != _INTEGRAL:
        memory[at] = signal


@njit(inline="always")
def _run_with_memory(  # noqa: PLR0913 - a kernel takes flat arrays
    code: int, signal: float, number: float, memory: FloatArray, at: int, phase: int, time_s: float, step_s: float
) -> float:
    """Value of an operator with memory. number: its second argument (constant); at: index of its memory."""
    if memory[0] != BEGUN:
        _initialise_memory(code, 0.0 if memory[0] == FROM_ZERO else signal, memory, at, time_s)
    if code == _LAG:
        return float(_lag(signal, number, memory, at, phase, step_s))
    if code == _PLAY:
        return float(_apply_play(signal, number, memory, at, phase))
    if code == _DELAY:
        return float(_delay(signal, number, memory, at, phase, time_s))
    return float(_integral(signal, memory, at, phase, step_s))


@njit(
    types.float64(_VECTOR, _VECTOR, _VECTOR, _VECTOR, types.int64, types.float64, types.float64),
    cache=True, nogil=True, error_model="numpy", **UNCOUNTED,
)  # fmt: skip
def run(  # noqa: PLR0913 - a kernel takes flat arrays
    program: FloatArray, signals: FloatArray, memory: FloatArray, stack: FloatArray, phase: int, time_s: float,
    step_s: float,
) -> float:  # fmt: skip
    """The law's value at a step's start or end (`phase`). program: (2 k,), code and operand in turn; signals:
    (columns,), at this instant; time_s: time of this instant; stack: (DEEPEST,), work space."""
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
            stack[top] = _binary(code, stack[top], stack[top + 1])
        elif code < _LAG:
            stack[top] = _apply_unary(code, stack[top])
        else:
            top -= code != _INTEGRAL
            stack[top] = _run_with_memory(
                code, stack[top], stack[top + 1], memory, int(program[row + 1]), phase, time_s, step_s
            )
    return float(stack[0])


@njit(types.void(_VECTOR, _VECTOR, types.float64), cache=True, nogil=True, **UNCOUNTED)
def commit_step(program: FloatArray, memory: FloatArray, time_s: float) -> None:
    """Store the end of the step that was run last as the start of the next step. time_s: time of that end."""
    for row in range(0, program.shape[0], 2):
        code, at = int(program[row]), int(program[row + 1])
        if code in (_LAG, _INTEGRAL):
            memory[at], memory[at + 1] = memory[at + 2], memory[at + 3]
        elif code == _PLAY:
            memory[at] = memory[at + 1]
        elif code == _DELAY and memory[at + 3 + 2 * _RING] > 0:
            _store_instant(memory[at + 2 + 2 * _RING], memory[at + 3 + 2 * _RING], memory, at, time_s)


@njit(types.void(_VECTOR, _MATRIX, _VECTOR, types.float64, _VECTOR), cache=True, nogil=True, error_model="numpy")
def run_along(program: FloatArray, signals: FloatArray, memory: FloatArray, step_s: float, out: FloatArray) -> None:
    """Writes the law's values to out (n,). signals: (n, k), straight lines from sample to sample, step_s seconds
    apart."""
    stack = np.empty(DEEPEST)
    for k in range(signals.shape[0]):
        out[k] = run(program, signals[k], memory, stack, END if k > 0 else START, k * step_s, step_s)
        if k > 0:
            commit_step(program, memory, k * step_s)
        memory[0] = BEGUN


@njit(types.void(_VECTOR, _MATRIX, _VECTOR, types.float64, _MATRIX), cache=True, nogil=True, error_model="numpy")
def run_along_held(
    program: FloatArray, signals: FloatArray, memory: FloatArray, step_s: float, out: FloatArray
) -> None:
    """Writes the law's values at the start and at the end of each step to out (2, n); signals (n, k) are held over a
    step of step_s seconds."""
    stack = np.empty(DEEPEST)
    for k in range(signals.shape[0]):
        out[0, k] = run(program, signals[k], memory, stack, START, k * step_s, step_s)
        memory[0] = BEGUN
        out[1, k] = run(program, signals[k], memory, stack, END, (k + 1) * step_s, step_s)
        commit_step(program, memory, (k + 1) * step_s)
