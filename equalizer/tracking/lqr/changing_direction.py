"""A transient whose direction changes while it is played: optimal forces from the model's present state at each tick.

The force of the tracker (`lqr`) is u_k = g_k - K_k x_k. The gains K do not depend on the direction, and the feedforward
g is linear in it: g is stored for each element of the direction (9 for a rotation of three axes, 3 for a normal), and a
new direction costs one linear combination per tick. Each tick is optimal for the remaining trajectory in the present
direction. Overlapping transients have a LiveState each, and their forces are added. `restart` replaces a transient by
another. Called by `contact` and by `equalizer.tracking.realtime`; sizes: n states, m forces, p responses.
"""

from dataclasses import dataclass

import numpy as np

from equalizer.signals.signal import FloatArray
from equalizer.tracking.lqr import lqr_kernel
from equalizer.tracking.lqr.lqr import StoredGains, compute_costate_feedforward
from equalizer.tracking.lqr.rotation import make_axis_recordings, make_axis_trajectories
from equalizer.tracking.lqr.tracking_problem import TrackingError, TrackingProblem, copy_read_only, require_trajectory


@dataclass(frozen=True, slots=True, eq=False)
class TurningTransient:
    """Stored gains and feedforward of a transient of N rows, made by `make_rotatable_transient` or
    `make_normal_transient`. Its arrays are arguments of `lqr_kernel.simulate_tick`, for compiled loops."""

    problem: TrackingProblem
    K: FloatArray
    """(N, m, n): gains on the state."""
    g: FloatArray
    """(N, m, c): feedforward per element of the direction, N; c = p p or p."""
    direction_shape: tuple[int, ...]
    """(p, p) where a direction is a rotation matrix; (p,) where it is a normal."""

    def __len__(self) -> int:
        return int(self.K.shape[0])


@dataclass(frozen=True, slots=True, eq=False)
class LiveState:
    """State of a transient while it is played: its next row, and the state of the model."""

    tick: int
    """Index of the next row."""
    x: FloatArray
    """(n,): state of the model before that row."""


@dataclass(frozen=True, slots=True, eq=False)
class TurningResult:
    """Forces and predicted response of T ticks; result of `play`."""

    forces: FloatArray
    """(T, m), N."""
    predicted: FloatArray
    """(T, p), m/s²: the model's response."""
    state: LiveState
    """State after the last of these rows."""


def make_rotatable_transient(gains: StoredGains, trajectory: FloatArray) -> TurningTransient:
    """Make the transient of a trajectory (N, p), m/s², before rotation. gains: for N rows, with a free end or rest as
    final state. Raises TrackingError for another shape and values that are not finite."""
    p = gains.problem.outputs
    return _make_transient(gains, make_axis_trajectories(require_trajectory(gains.problem, trajectory)), (p, p))


def make_normal_transient(gains: StoredGains, recording: FloatArray) -> TurningTransient:
    """Make the transient of a recording (N,), m/s², to be played along a normal (a unit vector per tick). Raises
    TrackingError as `make_rotatable_transient`."""
    p = gains.problem.outputs
    return _make_transient(gains, make_axis_recordings(recording, p), (p,))


def make_initial_state(transient: TurningTransient) -> LiveState:
    """Make the state at the first row, with the model at rest."""
    return LiveState(0, np.zeros(transient.problem.order))


def restart(state: LiveState) -> LiveState:
    """Make the state at the first row of a new transient, from the present state of the model: the free decay of the
    former transient is compensated."""
    return LiveState(0, state.x)


def step(transient: TurningTransient, state: LiveState, direction: FloatArray) -> tuple[FloatArray, LiveState]:
    """Compute the force (m,), N, of this tick, and the next state. After the last row the force is zero. direction: (p,
    p) or (p,). Raises TrackingError for another shape of the direction."""
    result = play(transient, np.asarray(direction, dtype=np.float64)[np.newaxis], state)
    return result.forces[0], result.state


def play(transient: TurningTransient, directions: FloatArray, state: LiveState | None = None) -> TurningResult:
    """Compute T ticks in a compiled loop. directions: (T, p, p) or (T, p), one per tick; state: None = first row, at
    rest. After the transient's last row the forces are zero. Raises TrackingError for another shape of the
    directions."""
    problem, start_state = transient.problem, make_initial_state(transient) if state is None else state
    direction_rows = np.asarray(directions, dtype=np.float64)
    if direction_rows.shape[1:] != transient.direction_shape:
        raise TrackingError(
            f"a direction has shape {direction_rows.shape[1:]}; this transient takes {transient.direction_shape}"
        )
    n, m = problem.order, problem.inputs
    work_array = np.zeros(2 * n + m + problem.outputs)
    work_array[:n] = problem.make_state(start_state.x)
    outputs = np.empty((len(direction_rows), m + problem.outputs))
    flat_directions = np.ascontiguousarray(direction_rows.reshape(len(direction_rows), -1))
    lqr_kernel.simulate_ticks(
        problem.step,
        transient.K[start_state.tick :],
        transient.g[start_state.tick :],
        flat_directions,
        work_array,
        outputs,
    )
    return TurningResult(
        outputs[:, :m], outputs[:, m:], LiveState(start_state.tick + len(direction_rows), work_array[:n])
    )


def _make_transient(gains: StoredGains, references: FloatArray, direction_shape: tuple[int, ...]) -> TurningTransient:
    """Make a transient from trajectories (c, N, p), one per element of the direction."""
    g = np.stack([compute_costate_feedforward(gains, reference) for reference in references], axis=2)
    return TurningTransient(gains.problem, gains.gains.K, copy_read_only(g), direction_shape)
