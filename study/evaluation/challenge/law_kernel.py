"""Forces of concealed laws outside the catalogue, a row for each law, at an integration step (compiled). Called by
`mechanism_kernel` at each step, and by `laws.build_law`.

The formulas and the ranges of their parameters are in `laws.concealed_laws`, by the same kinds.
"""

from math import atan, pi, sin, sqrt, tanh

from numba import njit

from equalizer.signals.signal import FloatArray

KIND, AXIS, OTHER_AXIS, FACTOR, FIRST, SECOND, SIDE = range(7)
"""Columns of a row: kind of law; axis on which it acts; another axis; size k and parameters a and b of its formula; its
sign s, +1 or -1."""
COLUMNS = 7
"""Number of columns of a row."""
(
    SPEED_POWER, PLACE_POWER, PLACE_DRAG, SPEED_SPRING, ATTRACTION, SOFT_DRAG, SOFT_SPRING, FADING_DRAG, CONTACT,
    EDGE_DRAG, GAIN_RIPPLE, PUMPED, RELAXATION, HEATING, CROSS_SQUARE, CROSS_SPRING, CROSS_DRAG, WHIRL, ALL_DRAG,
) = range(19)  # fmt: skip
"""Kinds of law: of the axis's own motion (to EDGE_DRAG), of command, time or a memory (to HEATING), of two axes. The
order matters for `compute_law_force`; `LAW_KINDS` in `laws.concealed_laws` gives the formulas."""


@njit(cache=True, nogil=True)
def compute_law_force(
    row: FloatArray, q: FloatArray, v: FloatArray, drive: FloatArray, memory: float, t: float
) -> float:
    """Force along the row's axis, N. q: positions (m); v: velocities (m/s); drive: forces of the drives (N); memory:
    state of a law with memory (`advance_law_memory`); t: time (s)."""
    kind, axis, other_axis = int(row[KIND]), int(row[AXIS]), int(row[OTHER_AXIS])
    if kind >= CROSS_SQUARE:
        return _compute_cross_axis_force(row, q[axis], v[axis], q[other_axis], v[other_axis])
    if kind >= GAIN_RIPPLE:
        return _compute_command_or_memory_force(row, q[axis], drive[axis], memory, t)
    return _compute_own_motion_force(row, q[axis], v[axis])


@njit(cache=True, nogil=True)
def _compute_own_motion_force(row: FloatArray, x: float, speed: float) -> float:
    """Force of a law of the axis's own position (m) and velocity (m/s), N."""
    kind, a, sign = int(row[KIND]), row[FIRST], row[SIDE]
    if kind == SPEED_POWER:
        force = abs(speed) ** a * (1.0 if speed > 0.0 else -1.0)
    elif kind == PLACE_POWER:
        force = abs(x) ** a * (1.0 if x > 0.0 else -1.0)
    elif kind == PLACE_DRAG:
        force = abs(x) ** a * speed
    elif kind == SPEED_SPRING:
        force = sign * x * abs(speed) ** a
    elif kind == ATTRACTION:
        force = -sign * ((a - sign * x) ** -row[SECOND] - a ** -row[SECOND])
    elif kind == SOFT_DRAG:
        force = tanh(speed / a)
    elif kind == SOFT_SPRING:
        force = atan(x / a)
    elif kind == FADING_DRAG:
        force = speed / (1.0 + (speed / a) ** 2)
    elif kind == CONTACT:
        force = sign * max(sign * x - a, 0.0) ** row[SECOND]
    else:
        force = speed if sign * x > a else 0.0
    scaled_force: float = -row[FACTOR] * force
    return scaled_force


@njit(cache=True, nogil=True)
def _compute_command_or_memory_force(row: FloatArray, x: float, drive: float, memory: float, t: float) -> float:
    """Force of a law of the drive force, the time or a memory state, N."""
    kind, a, b = int(row[KIND]), row[FIRST], row[SECOND]
    if kind == GAIN_RIPPLE:
        force = -drive * sin(2.0 * pi * x / a + b)
    elif kind == PUMPED:
        force = x * sin(2.0 * pi * a * t + b)
    elif kind == RELAXATION:
        force = x - memory
    else:
        force = drive * memory
    scaled_force: float = -row[FACTOR] * force
    return scaled_force


@njit(cache=True, nogil=True)
def _compute_cross_axis_force(row: FloatArray, x: float, speed: float, other_x: float, other_speed: float) -> float:
    """Force of a law of the motion of two axes, N."""
    kind, sign = int(row[KIND]), row[SIDE]
    if kind == CROSS_SQUARE:
        force = sign * other_x * other_x
    elif kind == CROSS_SPRING:
        force = x * other_x * other_x
    elif kind == CROSS_DRAG:
        force = speed * abs(other_speed)
    elif kind == WHIRL:
        force = -sign * other_speed
    else:
        force = speed * sqrt(speed * speed + other_speed * other_speed)
    scaled_force: float = -row[FACTOR] * force
    return scaled_force


@njit(cache=True, nogil=True)
def advance_law_memory(row: FloatArray, q: FloatArray, drive: FloatArray, memory: float, step_s: float) -> float:
    """Memory state at the end of a step, a first-order low pass (explicit Euler) with the time constant a (s): of the
    position (RELAXATION, m) or of the squared drive force (HEATING, N^2). Other laws have none."""
    kind, axis, new_memory = int(row[KIND]), int(row[AXIS]), memory
    if kind == RELAXATION:
        new_memory += (q[axis] - memory) * step_s / row[FIRST]
    elif kind == HEATING:
        new_memory += (drive[axis] * drive[axis] - memory) * step_s / row[FIRST]
    return new_memory


@njit(cache=True, nogil=True)
def sum_law_forces(
    rows: FloatArray,
    state: tuple[FloatArray, FloatArray, FloatArray],
    memory: FloatArray,
    t: float,
    total_n: FloatArray,
) -> None:
    """Sum of the forces of all laws, in `total_n` (3,), N. state: positions, velocities and drive forces, of which the
    first three elements (the handle's) are used. memory: memory states (laws,)."""
    total_n[:] = 0.0
    for law in range(rows.shape[0]):
        total_n[int(rows[law, AXIS])] += compute_law_force(rows[law], state[0], state[1], state[2], memory[law], t)
