"""A transient whose direction changes while it is played: optimal forces from the model's present state, at each tick.

The feedforward of the trajectory ahead is linear in the direction, and the gains do not depend on it: both are stored,
and a new direction costs a combination of nine numbers per axis. Each tick solves the rest of the trajectory exactly.
Overlapping transients have a LiveState each, and their forces are added. `restart` replaces a transient by another.
"""

from dataclasses import dataclass

import numpy as np

from equalizer.signals.signal import FloatArray
from equalizer.tracking.lqr import lqr_kernel
from equalizer.tracking.lqr.lqr import StoredGains, costate_feedforward
from equalizer.tracking.lqr.rotation import every_normal, every_rotation
from equalizer.tracking.lqr.tracking_problem import TrackingError, TrackingProblem, read_only, require_trajectory


@dataclass(frozen=True, slots=True, eq=False)
class TurningTransient:
    """Made by `make_rotatable_transient` or `normal_transient`. `lqr_kernel.tick` takes its arrays in a compiled
    loop."""

    problem: TrackingProblem
    K: FloatArray
    """(N, m, n)"""
    g: FloatArray
    """(N, m, directions)"""
    direction_shape: tuple[int, ...]
    """(p, p): a direction is a rotation; (p,): a normal."""

    def __len__(self) -> int:
        return int(self.K.shape[0])


@dataclass(frozen=True, slots=True, eq=False)
class LiveState:
    """State of a transient while it is played: its next row, and the state of the model."""

    tick: int
    """The row that comes next."""
    x: FloatArray
    """(n,): the state of the model."""


@dataclass(frozen=True, slots=True, eq=False)
class TurningResult:
    """Forces and predicted response of T ticks; result of `play`."""

    forces: FloatArray
    """(T, m)"""
    predicted: FloatArray
    """(T, p): the model's response."""
    state: LiveState
    """State after the last of these rows."""


def make_rotatable_transient(gains: StoredGains, trajectory: FloatArray) -> TurningTransient:
    """Transient of a trajectory (N, p), before it is rotated. The gains have a free end, or rest as final state."""
    p = gains.problem.outputs
    return _make_transient(gains, every_rotation(require_trajectory(gains.problem, trajectory)), (p, p))


def normal_transient(gains: StoredGains, recording: FloatArray) -> TurningTransient:
    """Transient of a recording (N,), to be played along a normal."""
    p = gains.problem.outputs
    return _make_transient(gains, every_normal(recording, p), (p,))


def initial_state(transient: TurningTransient) -> LiveState:
    """State at the first row, with the model at rest."""
    return LiveState(0, np.zeros(transient.problem.order))


def restart(state: LiveState) -> LiveState:
    """State at the first row, from the present motion: the former transient's free decay is compensated."""
    return LiveState(0, state.x)


def step(transient: TurningTransient, state: LiveState, direction: FloatArray) -> tuple[FloatArray, LiveState]:
    """The force (m,) of this tick, and the next state. After the last row the force is zero.

    Raises TrackingError on another shape of the direction.
    """
    turned = play(transient, np.asarray(direction, dtype=np.float64)[np.newaxis], state)
    return turned.forces[0], turned.state


def play(transient: TurningTransient, directions: FloatArray, state: LiveState | None = None) -> TurningResult:
    """Many ticks, compiled. directions: (T, p, p) or (T, p), one per tick; state: None = from rest, first row.

    Raises TrackingError on another shape of the directions.
    """
    problem, live = transient.problem, initial_state(transient) if state is None else state
    turns = np.asarray(directions, dtype=np.float64)
    if turns.shape[1:] != transient.direction_shape:
        raise TrackingError(
            f"a direction has shape {turns.shape[1:]}; this transient takes {transient.direction_shape}"
        )
    n, m = problem.order, problem.inputs
    numbers = np.zeros(2 * n + m + problem.outputs)
    numbers[:n] = problem.state(live.x)
    out = np.empty((len(turns), m + problem.outputs))
    flat = np.ascontiguousarray(turns.reshape(len(turns), -1))
    lqr_kernel.run(problem.step, transient.K[live.tick :], transient.g[live.tick :], flat, numbers, out)
    return TurningResult(out[:, :m], out[:, m:], LiveState(live.tick + len(turns), numbers[:n]))


def _make_transient(gains: StoredGains, wanted: FloatArray, direction_shape: tuple[int, ...]) -> TurningTransient:
    g = np.stack([costate_feedforward(gains, each) for each in wanted], axis=2)
    return TurningTransient(gains.problem, gains.gains.K, read_only(g), direction_shape)
