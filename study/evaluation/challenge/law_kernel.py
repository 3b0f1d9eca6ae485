"""Forces of concealed laws outside the catalogue of effects, at one integration step (compiled by Numba).

Each law is a row of numbers: its kind, axes and parameters. The formulas and the ranges of the parameters are in
`laws.concealed_laws`, by the same kinds.
"""

from math import atan, pi, sin, sqrt, tanh

from numba import njit

from equalizer.signals.signal import FloatArray

KIND, AXIS, OTHER_AXIS, SIZE, PARAMETER_A, PARAMETER_B, SIGN = range(7)
"""Columns of a row: kind of law; axis on which it acts, 0 to 2; the second axis of a law of two axes; size k and
parameters a and b of its formula, in SI units; its sign s, +1 or -1."""
COLUMN_COUNT = 7
"""Number of the columns above."""
(
    SPEED_POWER, POSITION_POWER, POSITION_DRAG, SPEED_SPRING, ATTRACTION, SOFT_DRAG, SOFT_SPRING, FADING_DRAG,
    CONTACT, ONE_SIDED_DRAG, GAIN_RIPPLE, PUMPED_STIFFNESS, RELAXATION, HEATING, CROSS_SQUARE, CROSS_SPRING,
    CROSS_DRAG, GYROSCOPIC, PATH_DRAG,
) = range(19)  # fmt: skip
"""Kinds of law: of the axis's own motion (to ONE_SIDED_DRAG), of command, time or a memory (to HEATING), of two axes.
The order matters for `compute_law_force`; `LAW_KINDS` in `laws.concealed_laws` gives the formulas."""


@njit(cache=True, nogil=True)
def compute_law_force(
    row: FloatArray, q: FloatArray, v: FloatArray, drive: FloatArray, memory: float, t: float
) -> float:
    """Compute the force along the row's axis, N. row (7,): the columns above; q: positions (m); v: velocities (m/s);
    drive: forces of the drives (N); memory: state of a law with memory (`advance_law_memory`); t: time (s)."""
    kind, axis, other_axis = int(row[KIND]), int(row[AXIS]), int(row[OTHER_AXIS])
    if kind >= CROSS_SQUARE:
        return _compute_cross_axis_force(row, q[axis], v[axis], q[other_axis], v[other_axis])
    if kind >= GAIN_RIPPLE:
        return _compute_command_or_memory_force(row, q[axis], drive[axis], memory, t)
    return _compute_own_motion_force(row, q[axis], v[axis])


@njit(cache=True, nogil=True)
def _compute_own_motion_force(row: FloatArray, x: float, velocity: float) -> float:
    """Compute the force (N) of a law of position x (m) and velocity (m/s) along the axis on which it acts."""
    kind, a, sign = int(row[KIND]), row[PARAMETER_A], row[SIGN]
    if kind == SPEED_POWER:
        force = abs(velocity) ** a * (1.0 if velocity > 0.0 else -1.0)
    elif kind == POSITION_POWER:
        force = abs(x) ** a * (1.0 if x > 0.0 else -1.0)
    elif kind == POSITION_DRAG:
        force = abs(x) ** a * velocity
    elif kind == SPEED_SPRING:
        force = sign * x * abs(velocity) ** a
    elif kind == ATTRACTION:
        force = -sign * ((a - sign * x) ** -row[PARAMETER_B] - a ** -row[PARAMETER_B])
    elif kind == SOFT_DRAG:
        force = tanh(velocity / a)
    elif kind == SOFT_SPRING:
        force = atan(x / a)
    elif kind == FADING_DRAG:
        force = velocity / (1.0 + (velocity / a) ** 2)
    elif kind == CONTACT:
        force = sign * max(sign * x - a, 0.0) ** row[PARAMETER_B]
    else:
        force = velocity if sign * x > a else 0.0
    scaled_force: float = -row[SIZE] * force
    return scaled_force


@njit(cache=True, nogil=True)
def _compute_command_or_memory_force(row: FloatArray, x: float, drive: float, memory: float, t: float) -> float:
    """Compute the force (N) of a law of the drive force (N), the time t (s) or a memory state; x: position (m)."""
    kind, a, phase_rad = int(row[KIND]), row[PARAMETER_A], row[PARAMETER_B]
    if kind == GAIN_RIPPLE:
        force = -drive * sin(2.0 * pi * x / a + phase_rad)
    elif kind == PUMPED_STIFFNESS:
        force = x * sin(2.0 * pi * a * t + phase_rad)
    elif kind == RELAXATION:
        force = x - memory
    else:
        force = drive * memory
    scaled_force: float = -row[SIZE] * force
    return scaled_force


@njit(cache=True, nogil=True)
def _compute_cross_axis_force(
    row: FloatArray, x: float, velocity: float, other_x: float, other_velocity: float
) -> float:
    """Compute the force (N) of a law of the motion of two axes: position (m) and velocity (m/s) of each."""
    kind, sign = int(row[KIND]), row[SIGN]
    if kind == CROSS_SQUARE:
        force = sign * other_x * other_x
    elif kind == CROSS_SPRING:
        force = x * other_x * other_x
    elif kind == CROSS_DRAG:
        force = velocity * abs(other_velocity)
    elif kind == GYROSCOPIC:
        force = -sign * other_velocity
    else:
        force = velocity * sqrt(velocity * velocity + other_velocity * other_velocity)
    scaled_force: float = -row[SIZE] * force
    return scaled_force


@njit(cache=True, nogil=True)
def advance_law_memory(row: FloatArray, q: FloatArray, drive: FloatArray, memory: float, step_s: float) -> float:
    """Compute the memory state at the end of a step, a first-order low pass (explicit Euler) with the time constant a
    (s): of the position (RELAXATION, m) or of the squared drive force (HEATING, N^2). Other laws have none: their state
    is returned unchanged."""
    kind, axis, new_memory = int(row[KIND]), int(row[AXIS]), memory
    if kind == RELAXATION:
        new_memory += (q[axis] - memory) * step_s / row[PARAMETER_A]
    elif kind == HEATING:
        new_memory += (drive[axis] * drive[axis] - memory) * step_s / row[PARAMETER_A]
    return new_memory


@njit(cache=True, nogil=True)
def sum_law_forces(
    rows: FloatArray,
    state: tuple[FloatArray, FloatArray, FloatArray],
    memory: FloatArray,
    t: float,
    total_n: FloatArray,
) -> None:
    """Write the sum of the forces of all laws per axis into `total_n` (3,), N. rows: (laws, 7); state: positions,
    velocities and drive forces, of which the first three elements (the handle's) are used. memory: memory states
    (laws,)."""
    total_n[:] = 0.0
    for index in range(rows.shape[0]):
        total_n[int(rows[index, AXIS])] += compute_law_force(
            rows[index], state[0], state[1], state[2], memory[index], t
        )
