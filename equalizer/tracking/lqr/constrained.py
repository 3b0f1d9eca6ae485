"""Optimal tracking under a cap on the force (ADMM): a constrained problem instead of clipping, with its loss stated.

    least  sum (y - r)' Q (y - r) + u' R u    with    |u_k + already_k| <= cap  at every tick

Alternating directions (Boyd et al., Distributed Optimization and Statistical Learning via ADMM, 2011): tracking with
the gains of one Riccati recursion, then the nearest forces that are allowed, in turn. The multipliers give a lower
bound of the cost (duality), so that the distance from the optimum is known.
"""

from dataclasses import dataclass, replace

import numpy as np
from scipy.linalg import block_diag

from equalizer.signals.signal import FloatArray
from equalizer.tracking.lqr.limits import force_peaks, project_to_cap, require_cap
from equalizer.tracking.lqr.lqr import StoredGains, stored_gains, track
from equalizer.tracking.lqr.lqr_kernel import simulate
from equalizer.tracking.lqr.tracking_problem import TrackingError, TrackingProblem, require_trajectory

OVER_RELAXATION = 1.7
"""Over-relaxation of ADMM; 1.5 to 1.8 converges fastest (Boyd and others 2011, section 3.4.3)."""
ROUNDS_BETWEEN_TUNING = 25
"""Iterations between changes of ADMM's penalty: each change costs a Riccati recursion."""


@dataclass(frozen=True, slots=True)
class TrackingLoss:
    """Tracking errors are rms of (predicted - wanted) over rms of wanted."""

    error_free: float
    """Error of the best forces without a cap."""
    error_capped: float
    """Error of the returned forces."""
    error_clipped: float
    """Error of the unconstrained forces with clipping, for comparison; they are never played."""
    cost_free: float
    cost_capped: float
    gap: float
    """Relative duality gap: by how much the cost could be lower at most; 0 = proved optimal."""
    rounds: int

    @property
    def lost(self) -> float:
        """How much the cap adds to the tracking error, in the same measure."""
        return self.error_capped - self.error_free


@dataclass(frozen=True, slots=True, eq=False)
class CappedForces:
    """Result of `track_under_cap`: forces from rest under the cap, and the tracking error that the cap causes."""

    forces: FloatArray
    """(N, m); together with the forces `already` there, every row is within the cap."""
    predicted: FloatArray
    """(N, p): the model's response."""
    loss: TrackingLoss


@dataclass(frozen=True, slots=True)
class CapSettings:
    """Stopping rule of ADMM: the duality gap that must be reached, and the largest number of iterations."""

    gap: float = 1e-5
    """Relative duality gap at which the iteration ends."""
    rounds: int = 5000


@dataclass(frozen=True, slots=True, eq=False)
class _CappedTask:
    problem: TrackingProblem
    wanted: FloatArray
    already: FloatArray
    cap_n: float

    def nearest(self, forces: FloatArray) -> FloatArray:
        return project_to_cap(forces + self.already, self.cap_n) - self.already

    def cost(self, forces: FloatArray) -> float:
        outputs = _simulate_outputs(self.problem, forces)
        outputs[:, : self.problem.outputs] -= self.wanted
        weighed = (outputs @ self.problem.Q * outputs).sum() + (forces @ self.problem.R * forces).sum()
        return float(weighed)

    def lower_bound(self, forces: FloatArray, multipliers: FloatArray) -> float:
        """Lower bound of the optimal cost (dual function). forces: minimum of cost + multipliers · forces, without a
        cap."""
        reach = self.cap_n * np.linalg.norm(multipliers, axis=1).sum() - (multipliers * self.already).sum()
        return self.cost(forces) + float((multipliers * forces).sum() - reach)


def track_under_cap(
    problem: TrackingProblem,
    wanted: FloatArray,
    cap_n: float,
    already: FloatArray | None = None,
    settings: CapSettings | None = None,
) -> CappedForces:
    """Track wanted (N, p), from rest. already: (N, m), further forces, which count against the cap.

    Raises TrackingError where `already` alone is above the cap, or where the duality gap is not reached in the allowed
    rounds.
    """
    r = require_trajectory(problem, wanted)
    there = np.zeros((len(r), problem.inputs)) if already is None else np.asarray(already, dtype=np.float64)
    if there.shape != (len(r), problem.inputs):
        raise TrackingError(f"already has shape {there.shape}; these forces have ({len(r)}, {problem.inputs})")
    alone = force_peaks(there, require_cap(cap_n))
    if not alone.fits:
        raise TrackingError(
            f"the other forces alone reach {alone.peak_n:.3g} N at row {alone.at_sample}, above the cap of {cap_n:g} "
            "N; lower them, or raise the cap"
        )
    task = _CappedTask(problem, r, there, cap_n)
    free = track(stored_gains(problem, len(r)), r)
    if force_peaks(free.forces + there, cap_n).fits:
        return _state_loss(task, free.forces, free.forces, 0.0, 0)
    return _state_loss(task, free.forces, *_alternate_directions(task, free.forces, settings or CapSettings()))


def _alternate_directions(task: _CappedTask, start: FloatArray, settings: CapSettings) -> tuple[FloatArray, float, int]:
    """Alternating direction method of multipliers. Returns forces, relative duality gap and rounds."""
    weight = _initial_penalty(task.problem)
    gains = _compute_penalised_gains(task.problem, len(task.wanted), weight)
    z, scaled = task.nearest(start), np.zeros_like(start)
    best, best_cost, bound = z, task.cost(z), -np.inf
    for number in range(1, settings.rounds + 1):
        u = track(gains, np.hstack((task.wanted, z - scaled))).forces
        bound = max(bound, task.lower_bound(u, 2 * weight * (u - z + scaled)))
        relaxed = OVER_RELAXATION * u + (1 - OVER_RELAXATION) * z
        before, z = z, task.nearest(relaxed + scaled)
        scaled = scaled + relaxed - z
        cost = task.cost(z)
        if cost < best_cost:
            best, best_cost = z, cost
        gap = max(0.0, (best_cost - bound) / best_cost)
        if gap <= settings.gap:
            return best, gap, number
        factor = _penalty_factor(u - z, z - before) if number % ROUNDS_BETWEEN_TUNING == 0 else 1.0
        if factor != 1.0:
            weight, scaled = weight * factor, scaled / factor
            gains = _compute_penalised_gains(task.problem, len(task.wanted), weight)
    raise TrackingError(
        f"after {settings.rounds} rounds the forces under the cap of {task.cap_n:g} N are only known to be within "
        f"{gap:.2g} of the best cost; scale what is wanted down, or allow a larger gap than {settings.gap:g}"
    )


def _penalty_factor(apart: FloatArray, moved: FloatArray) -> float:
    """Factor on the penalty that balances primal and dual residual (Boyd et al., 3.4.1)."""
    ratio = float(np.linalg.norm(apart) / max(float(np.linalg.norm(moved)), np.finfo(np.float64).tiny))
    return float(np.clip(np.sqrt(ratio), 0.2, 5.0)) if not 1 / 3 < ratio < 3 else 1.0


def _initial_penalty(problem: TrackingProblem) -> float:
    """Initial penalty: geometric mean of the force weight and the curvature of the model's direct response."""
    curvature = problem.stage_cost[problem.order :, problem.order :]
    return float(np.sqrt(max(np.linalg.eigvalsh(problem.R)[0], 1e-6) * max(np.trace(curvature), 1.0)))


def _compute_penalised_gains(problem: TrackingProblem, samples: int, weight: float) -> StoredGains:
    """Gains of the problem with the penalty weight·|u - w|²: the forces are further outputs, w is wanted beside r."""
    p, m = problem.outputs, problem.inputs
    C = np.insert(problem.C, [p] * m, np.zeros((m, problem.order)), axis=0)
    D = np.insert(problem.D, [p] * m, np.eye(m), axis=0)
    Q = block_diag(problem.Q[:p, :p], weight * np.eye(m), problem.Q[p:, p:])
    return stored_gains(replace(problem, C=C, D=D, Q=Q, outputs=p + m), samples)


def _simulate_outputs(problem: TrackingProblem, forces: FloatArray) -> FloatArray:
    """(N, q): all outputs, with the penalised ones, to forces (N, m) from rest."""
    outputs, played = np.empty((len(forces), problem.C.shape[0])), np.empty_like(forces)
    every = replace(problem, outputs=problem.C.shape[0]).step
    no_gain = np.zeros((len(forces), problem.inputs, problem.order))
    simulate(every, no_gain, np.ascontiguousarray(forces), np.zeros(problem.order), played, outputs)
    return outputs


def _state_loss(task: _CappedTask, free: FloatArray, forces: FloatArray, gap: float, rounds: int) -> CappedForces:
    p, size = task.problem.outputs, float(np.linalg.norm(task.wanted)) or 1.0

    def error(played: FloatArray) -> float:
        return float(np.linalg.norm(_simulate_outputs(task.problem, played)[:, :p] - task.wanted)) / size

    loss = TrackingLoss(
        error(free),
        error(forces),
        error(task.nearest(free)),
        task.cost(free),
        task.cost(forces),
        gap,
        rounds,
    )
    return CappedForces(forces, _simulate_outputs(task.problem, forces)[:, :p], loss)
