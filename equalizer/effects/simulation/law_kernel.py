"""Force of a discovered law over one integration step, compiled: implicit solution by secant and bisection.

The force F that is held over the step solves F = (1 - w) F_start + w F_end(F), because the motion at the step's end
depends on F. The weight w is 1/2 (trapezoidal rule) for a force that hardly depends on the motion, and grows with the
steepness of that dependence up to 1 (backward Euler), where the mean would oscillate (dry friction, stops): the motion
can then stick. A law that reads an acceleration has w = 1.
"""

from numba import njit

from equalizer.effects.simulation.instant import (
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
)
from equalizer.effects.simulation.mechanism_kernel import compile_law
from equalizer.laws.kernel import END, START, STARTED, commit_step, run
from equalizer.laws.program import STACK_SIZE
from equalizer.signals.signal import FloatArray

AXES, ACCELERATION, CONDITIONS, SAMPLES, RATE_HZ, TABLE = range(6)
"""Indices in `parameters`: number of driven axes; whether the law reads an acceleration; number of recorded
conditions, number of their samples, and their rate (Hz); first value of the conditions, which are stored sample by
sample. The law's program follows them."""
PER_AXIS = 4
"""Signals per driven axis: position, velocity, acceleration, command. The time precedes those of all axes, the
conditions follow them."""
FORCE_TOLERANCE = 1e-7
"""Tolerance of the implicit equation, relative to the forces of its first evaluations."""
TRIES = 60
"""Most iterations of the root search (regula falsi and bisection in turn) for a law's force at the end of a step."""


@njit(inline="always")
def _law_value(
    parameters: FloatArray, memory: FloatArray, at: FloatArray, phase: int, force: float, extrapolate: float
) -> float:
    """The law's force (N) at the step's start or end (`phase`), if `force` acted over the step. Accelerations are means
    over the step; with extrapolate = 1 they are extrapolated linearly to its end."""
    axes, conditions, step_s = int(parameters[AXES]), int(parameters[CONDITIONS]), at[STEP_S]
    count = 1 + PER_AXIS * axes + conditions
    signals = memory[STACK_SIZE : STACK_SIZE + count]
    time_s = at[TIME_S] + (step_s if phase == END else 0.0)
    signals[0] = time_s
    for axis in range(axes):
        block, target = LENGTH + BLOCK_SIZE * axis, 1 + PER_AXIS * axis
        v, v_end = at[block + AXIS_V], at[block + AXIS_V_END] + at[block + AXIS_V_PER_N] * force
        signals[target], signals[target + 1], signals[target + 2] = at[block + AXIS_X], v, (v_end - v) / step_s
        if phase == END:
            signals[target] = at[block + AXIS_X_END] + at[block + AXIS_X_PER_N] * force
            signals[target + 1] = v_end
        if extrapolate != 0.0:
            signals[target + 2] += signals[target + 2] - at[block + AXIS_A] - at[block + AXIS_A_PER_N] * force
        signals[target + 3] = at[block + AXIS_COMMAND]
    samples = int(parameters[SAMPLES])
    if conditions > 0:
        # Sampled at the middle of the step, which lies in the right sample even when the ends are rounded.
        sample = max(min(int((at[TIME_S] + 0.5 * step_s) * parameters[RATE_HZ]), samples - 1), 0)
        for k in range(conditions):
            signals[count - conditions + k] = parameters[TABLE + sample * conditions + k]
    program = parameters[TABLE + samples * conditions :]
    return float(run(program, signals, memory[STACK_SIZE + count :], memory[:STACK_SIZE], phase, time_s, step_s))


@njit(inline="always")
def _end_share(start: float, first: float, second: float) -> float:
    """Weight w of the step's end: (1 + s) / 2, limited to 1/2 to 1, with the slope s = -dF_end/dF as a difference
    quotient. first: the end's force if that of the start acted; second: the end's force if `first` acted."""
    change = first - start
    slope = (first - second) / change if change != 0.0 else 0.0
    return min(0.5 * (1.0 + max(slope, 0.0)), 1.0)


@compile_law
def law_force(parameters: FloatArray, memory: FloatArray, at: FloatArray) -> float:
    """Force (N) of a discovered law over a step, solved for, because the motion at the step's end depends on it.

    parameters: in the order of `AXES` to `TABLE`, then the conditions' samples and the program. memory: stack, signals,
    and the operators' memory, which is advanced to the step's end. at: see `instant`; F_END is written.
    """
    reads_acceleration = parameters[ACCELERATION] != 0.0
    start = low = _law_value(parameters, memory, at, START, 0.0, 0.0)
    conditions = int(parameters[CONDITIONS])
    operator_memory = memory[STACK_SIZE + 1 + PER_AXIS * int(parameters[AXES]) + conditions :]
    operator_memory[0] = STARTED
    end = first = high = _law_value(parameters, memory, at, END, low, 0.0)
    second = _law_value(parameters, memory, at, END, high, 0.0)
    end_weight = 1.0 if reads_acceleration else _end_share(start, first, second)
    low_residual, high_residual = (
        low - (1 - end_weight) * start - end_weight * first,
        high - (1 - end_weight) * start - end_weight * second,
    )
    tolerance, force = FORCE_TOLERANCE * (abs(start) + abs(first) + abs(second)), high
    # Every second step bisects if the root is bracketed; the others are secant steps.
    for iteration in range(TRIES):
        residual_change = high_residual - low_residual
        is_bracketed = (low_residual < 0) != (high_residual < 0)
        if iteration % 2 == 1 and is_bracketed:
            force = 0.5 * (low + high)
        else:
            force = high - high_residual * (high - low) / residual_change if residual_change != 0.0 else high
        end = _law_value(parameters, memory, at, END, force, 0.0)
        residual = force - (1 - end_weight) * start - end_weight * end
        if not abs(residual) > tolerance or abs(high - low) <= 1e-2 * tolerance:
            break
        if is_bracketed and (residual < 0) == (low_residual < 0):
            low, low_residual = force, residual
        else:
            if not is_bracketed:
                low, low_residual = high, high_residual
            high, high_residual = force, residual
    # While sticking, the end's force lies between those of the two sliding directions: solved for, not evaluated.
    at[F_END] = (
        _law_value(parameters, memory, at, END, force, 1.0)
        if reads_acceleration
        else (force - (1 - end_weight) * start) / end_weight
    )
    commit_step(parameters[TABLE + int(parameters[SAMPLES]) * conditions :], operator_memory, at[TIME_S] + at[STEP_S])
    return float(force)
