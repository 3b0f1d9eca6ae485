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
from equalizer.laws.kernel import END, START, STARTED, commit_step, run_program
from equalizer.laws.program import STACK_SIZE
from equalizer.signals.signal import FloatArray

AXIS_COUNT, READS_ACCELERATION, CONDITION_COUNT, SAMPLE_COUNT, CONDITION_RATE_HZ, CONDITION_VALUES = range(6)
"""Indices in `parameters`: number of driven axes; whether the law reads an acceleration; number of recorded conditions,
number of their samples, and their rate (Hz); first value of the conditions, which are stored sample by sample. The
law's program follows them."""
SIGNALS_PER_AXIS = 4
"""Signals per driven axis: position, velocity, acceleration, command. The time precedes those of all axes, the
conditions follow them."""
FORCE_TOLERANCE = 1e-7
"""Tolerance of the implicit equation, relative to the forces of its first evaluations. Chosen."""
MAX_ROOT_ITERATIONS = 60
"""Largest number of iterations of the root search: secant steps and, every second one, bisection where the root is
bracketed. Chosen."""


@njit(inline="always")
def _evaluate_force(
    parameters: FloatArray, memory: FloatArray, step_motion: FloatArray, phase: int, force: float, extrapolate: float
) -> float:
    """Evaluate the law's force (N) at the step's start or end (`phase`: START or END), if `force` (N) acted over the
    step. Accelerations are means over the step; with extrapolate = 1 they are extrapolated linearly to its end."""
    m, condition_count, step_s = (int(parameters[AXIS_COUNT]), int(parameters[CONDITION_COUNT]), step_motion[STEP_S])
    signal_count = 1 + SIGNALS_PER_AXIS * m + condition_count
    signals = memory[STACK_SIZE : STACK_SIZE + signal_count]
    time_s = step_motion[TIME_S] + (step_s if phase == END else 0.0)
    signals[0] = time_s
    for axis in range(m):
        block, first = LENGTH + BLOCK_SIZE * axis, 1 + SIGNALS_PER_AXIS * axis
        v, v_end = (
            step_motion[block + AXIS_V],
            step_motion[block + AXIS_V_END] + step_motion[block + AXIS_V_PER_N] * force,
        )
        signals[first], signals[first + 1], signals[first + 2] = (step_motion[block + AXIS_X], v, (v_end - v) / step_s)
        if phase == END:
            signals[first] = step_motion[block + AXIS_X_END] + step_motion[block + AXIS_X_PER_N] * force
            signals[first + 1] = v_end
        if extrapolate != 0.0:
            signals[first + 2] += (
                signals[first + 2] - step_motion[block + AXIS_A] - step_motion[block + AXIS_A_PER_N] * force
            )
        signals[first + 3] = step_motion[block + AXIS_COMMAND]
    sample_count = int(parameters[SAMPLE_COUNT])
    if condition_count > 0:
        # Sampled at the middle of the step, which lies in the right sample even when the ends are rounded.
        condition_sample = max(
            min(int((step_motion[TIME_S] + 0.5 * step_s) * parameters[CONDITION_RATE_HZ]), sample_count - 1), 0
        )
        for condition in range(condition_count):
            signals[signal_count - condition_count + condition] = parameters[
                CONDITION_VALUES + condition_sample * condition_count + condition
            ]
    program = parameters[CONDITION_VALUES + sample_count * condition_count :]
    return float(
        run_program(program, signals, memory[STACK_SIZE + signal_count :], memory[:STACK_SIZE], phase, time_s, step_s)
    )


@njit(inline="always")
def _compute_end_weight(start_force: float, first_end_force: float, second_end_force: float) -> float:
    """Compute the weight w of the step's end: (1 + s) / 2, limited to 1/2 to 1, with the slope s = -dF_end/dF as a
    difference quotient. first_end_force: force (N) at the end if `start_force` acted; second_end_force: that if
    `first_end_force` acted."""
    force_change = first_end_force - start_force
    slope = (first_end_force - second_end_force) / force_change if force_change != 0.0 else 0.0
    return min(0.5 * (1.0 + max(slope, 0.0)), 1.0)


@compile_law
def compute_law_force(parameters: FloatArray, memory: FloatArray, step_motion: FloatArray) -> float:
    """Compute the force (N) of a discovered law over a step by root search, because the motion at the step's end
    depends on it.

    parameters: in the order of `AXIS_COUNT` to `CONDITION_VALUES`, then the conditions' samples and the program.
    memory: stack, signals, and the operators' memory, which is advanced to the step's end. step_motion: see `instant`;
    F_END is written. w, f_start, f_end: as in the equation of the module; f_end_1, f_end_2: F_end(f_start) and
    F_end(f_end_1); f_low, f_high: forces that bracket the root, or the last two of the secant method. An inertial law
    is one that reads an acceleration.
    """
    is_inertial = parameters[READS_ACCELERATION] != 0.0
    f_start = f_low = _evaluate_force(parameters, memory, step_motion, START, 0.0, 0.0)
    condition_count = int(parameters[CONDITION_COUNT])
    operator_memory = memory[STACK_SIZE + 1 + SIGNALS_PER_AXIS * int(parameters[AXIS_COUNT]) + condition_count :]
    operator_memory[0] = STARTED
    f_end = f_end_1 = f_high = _evaluate_force(parameters, memory, step_motion, END, f_low, 0.0)
    f_end_2 = _evaluate_force(parameters, memory, step_motion, END, f_high, 0.0)
    w = 1.0 if is_inertial else _compute_end_weight(f_start, f_end_1, f_end_2)
    low_residual, high_residual = (f_low - (1 - w) * f_start - w * f_end_1, f_high - (1 - w) * f_start - w * f_end_2)
    tolerance, force = FORCE_TOLERANCE * (abs(f_start) + abs(f_end_1) + abs(f_end_2)), f_high
    for iteration in range(MAX_ROOT_ITERATIONS):
        residual_change = high_residual - low_residual
        is_bracketed = (low_residual < 0) != (high_residual < 0)
        if iteration % 2 == 1 and is_bracketed:
            force = 0.5 * (f_low + f_high)
        else:
            force = f_high - high_residual * (f_high - f_low) / residual_change if residual_change != 0.0 else f_high
        f_end = _evaluate_force(parameters, memory, step_motion, END, force, 0.0)
        residual = force - (1 - w) * f_start - w * f_end
        if not abs(residual) > tolerance or abs(f_high - f_low) <= 1e-2 * tolerance:
            break
        if is_bracketed and (residual < 0) == (low_residual < 0):
            f_low, low_residual = force, residual
        else:
            if not is_bracketed:
                f_low, low_residual = f_high, high_residual
            f_high, high_residual = force, residual
    # While sticking, the end's force lies between those of the two sliding directions: solved for, not evaluated.
    step_motion[F_END] = (
        _evaluate_force(parameters, memory, step_motion, END, force, 1.0)
        if is_inertial
        else (force - (1 - w) * f_start) / w
    )
    commit_step(
        parameters[CONDITION_VALUES + int(parameters[SAMPLE_COUNT]) * condition_count :],
        operator_memory,
        step_motion[TIME_S] + step_motion[STEP_S],
    )
    return float(force)
