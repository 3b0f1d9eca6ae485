"""Forces of concealed laws outside the catalogue, a row for each law, at an integration step (compiled).

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
order matters for `law_force`; `LAW_KINDS` in `laws.concealed_laws` gives the formulas."""


@njit(cache=True, nogil=True)
def law_force(row: FloatArray, q: FloatArray, v: FloatArray, drive: FloatArray, memory: float, t: float) -> float:
    """Force along the row's axis, N. q: positions (m); v: velocities (m/s); drive: forces of the drives (N); memory:
    state of a law with memory (`law_memory`); t: time (s)."""
    kind, j, k = int(row[KIND]), int(row[AXIS]), int(row[OTHER_AXIS])
    if kind >= CROSS_SQUARE:
        return _cross_axis_force(row, q[j], v[j], q[k], v[k])
    if kind >= GAIN_RIPPLE:
        return _command_or_memory_force(row, q[j], drive[j], memory, t)
    return _own_motion_force(row, q[j], v[j])


@njit(cache=True, nogil=True)
def _own_motion_force(row: FloatArray, x: float, speed: float) -> float:
    """Force of a law of the axis's own position (m) and velocity (m/s), N."""
    kind, first, side = int(row[KIND]), row[FIRST], row[SIDE]
    if kind == SPEED_POWER:
        force = abs(speed) ** first * (1.0 if speed > 0.0 else -1.0)
    elif kind == PLACE_POWER:
        force = abs(x) ** first * (1.0 if x > 0.0 else -1.0)
    elif kind == PLACE_DRAG:
        force = abs(x) ** first * speed
    elif kind == SPEED_SPRING:
        force = side * x * abs(speed) ** first
    elif kind == ATTRACTION:
        force = -side * ((first - side * x) ** -row[SECOND] - first ** -row[SECOND])
    elif kind == SOFT_DRAG:
        force = tanh(speed / first)
    elif kind == SOFT_SPRING:
        force = atan(x / first)
    elif kind == FADING_DRAG:
        force = speed / (1.0 + (speed / first) ** 2)
    elif kind == CONTACT:
        force = side * max(side * x - first, 0.0) ** row[SECOND]
    else:
        force = speed if side * x > first else 0.0
    scaled_force: float = -row[FACTOR] * force
    return scaled_force


@njit(cache=True, nogil=True)
def _command_or_memory_force(row: FloatArray, x: float, drive: float, memory: float, t: float) -> float:
    """Force of a law of the drive force, the time or a memory state, N."""
    kind, first, second = int(row[KIND]), row[FIRST], row[SECOND]
    if kind == GAIN_RIPPLE:
        force = -drive * sin(2.0 * pi * x / first + second)
    elif kind == PUMPED:
        force = x * sin(2.0 * pi * first * t + second)
    elif kind == RELAXATION:
        force = x - memory
    else:
        force = drive * memory
    scaled_force: float = -row[FACTOR] * force
    return scaled_force


@njit(cache=True, nogil=True)
def _cross_axis_force(row: FloatArray, x: float, speed: float, other_x: float, other_speed: float) -> float:
    """Force of a law of the motion of two axes, N."""
    kind, side = int(row[KIND]), row[SIDE]
    if kind == CROSS_SQUARE:
        force = side * other_x * other_x
    elif kind == CROSS_SPRING:
        force = x * other_x * other_x
    elif kind == CROSS_DRAG:
        force = speed * abs(other_speed)
    elif kind == WHIRL:
        force = -side * other_speed
    else:
        force = speed * sqrt(speed * speed + other_speed * other_speed)
    scaled_force: float = -row[FACTOR] * force
    return scaled_force


@njit(cache=True, nogil=True)
def law_memory(row: FloatArray, q: FloatArray, drive: FloatArray, memory: float, step_s: float) -> float:
    """Memory state at the end of a step, a first-order low pass (explicit Euler) with the time constant a (s): of the
    position (RELAXATION, m) or of the squared drive force (HEATING, N^2). Other laws have none."""
    kind, j, new_memory = int(row[KIND]), int(row[AXIS]), memory
    if kind == RELAXATION:
        new_memory += (q[j] - memory) * step_s / row[FIRST]
    elif kind == HEATING:
        new_memory += (drive[j] * drive[j] - memory) * step_s / row[FIRST]
    return new_memory


@njit(cache=True, nogil=True)
def law_forces(
    rows: FloatArray,
    state: tuple[FloatArray, FloatArray, FloatArray],
    memory: FloatArray,
    t: float,
    total_n: FloatArray,
) -> None:
    """Sum of the forces of all laws, in `total_n` (3,), N. state: positions, velocities and drive forces, of which the
    first three elements (the handle's) are used. memory: memory states (laws,)."""
    total_n[:] = 0.0
    for index in range(rows.shape[0]):
        total_n[int(rows[index, AXIS])] += law_force(rows[index], state[0], state[1], state[2], memory[index], t)
