"""Optimal tracking under a cap on the force: a constrained problem, not clipping, with the tracking loss stated.

    minimise  sum (y_k - r_k)' Q (y_k - r_k) + u_k' R u_k    subject to    |u_k + f_k| <= cap    for every k

with fixed further forces f. By the alternating direction method of multipliers, ADMM (Boyd et al., Distributed
Optimization and Statistical Learning via the Alternating Direction Method of Multipliers, 2011). Two steps alternate:
tracking with stored gains, and projection of the forces on the cap. The multipliers give a lower bound of the optimal
cost (duality), so that the distance from the optimum is known.
"""

from dataclasses import dataclass, replace

import numpy as np
from scipy.linalg import block_diag

from equalizer.signals.signal import FloatArray
from equalizer.tracking.lqr.limits import find_force_peaks, project_to_cap, require_cap
from equalizer.tracking.lqr.lqr import StoredGains, compute_stored_gains, track
from equalizer.tracking.lqr.lqr_kernel import simulate
from equalizer.tracking.lqr.tracking_problem import TrackingError, TrackingProblem, require_trajectory

OVER_RELAXATION = 1.7
"""Over-relaxation of ADMM; 1.5 to 1.8 can improve the convergence (Boyd et al. 2011, section 3.4.3)."""
ROUNDS_BETWEEN_TUNING = 25
"""Number of iterations between changes of the penalty of ADMM; each change costs a Riccati recursion. Chosen."""


@dataclass(frozen=True, slots=True)
class TrackingLoss:
    """Tracking error and cost without and with the cap. Errors are rms of (predicted - reference) over rms of the
    reference; for a reference of zeros, the norm of the predicted acceleration."""

    error_free: float
    """Error of the optimal forces free of a cap."""
    error_capped: float
    """Error of the returned forces."""
    error_clipped: float
    """Error of the optimal forces after clipping to the cap, for comparison."""
    cost_free: float
    """Value of the cost for the optimal forces without a cap."""
    cost_capped: float
    """Value of the cost for the returned forces."""
    gap: float
    """Relative duality gap: bound of the excess of the cost over the optimum, relative to the cost; 0 = optimal."""
    rounds: int
    """Iterations of ADMM; 0 where the forces without a cap were under it."""

    @property
    def lost(self) -> float:
        """Increase of the relative tracking error due to the cap."""
        return self.error_capped - self.error_free


@dataclass(frozen=True, slots=True, eq=False)
class CappedForces:
    """Result of `track_under_cap`: forces from rest under the cap, and the tracking error that the cap causes."""

    forces: FloatArray
    """(N, m), N; the norm of each row of their sum with the further forces `already_planned` is within the cap."""
    predicted: FloatArray
    """(N, p), m/s²: the model's response to `forces`, from rest."""
    loss: TrackingLoss


@dataclass(frozen=True, slots=True)
class CapSettings:
    """Stopping rule of ADMM: the duality gap that must be reached, and the largest number of iterations. Defaults
    chosen."""

    gap: float = 1e-5
    """Relative duality gap at which the iteration ends."""
    rounds: int = 5000
    """Largest number of iterations; TrackingError beyond."""


@dataclass(frozen=True, slots=True, eq=False)
class _CappedProblem:
    """The constrained problem of one trajectory: `reference` (N, p), m/s²; `fixed_forces` (N, m), N, which count
    against the cap too; the cap in N."""

    problem: TrackingProblem
    reference: FloatArray
    fixed_forces: FloatArray
    cap_n: float

    def project(self, forces: FloatArray) -> FloatArray:
        """Project forces (N, m) on those allowed under the cap, row by row."""
        return project_to_cap(forces + self.fixed_forces, self.cap_n) - self.fixed_forces

    def compute_cost(self, forces: FloatArray) -> float:
        """Compute the quadratic cost of forces (N, m) from rest."""
        outputs = _simulate_outputs(self.problem, forces)
        outputs[:, : self.problem.outputs] -= self.reference
        cost = (outputs @ self.problem.Q * outputs).sum() + (forces @ self.problem.R * forces).sum()
        return float(cost)

    def compute_lower_bound(self, forces: FloatArray, multipliers: FloatArray) -> float:
        """Compute the lower bound of the optimal cost, the dual function: cost(u) + λ·u - sum_k (cap |λ_k| - λ_k·f_k),
        with the fixed forces f. forces: u, which minimises cost(u) + λ·u without a cap; multipliers: λ, (N, m)."""
        support = self.cap_n * np.linalg.norm(multipliers, axis=1).sum() - (multipliers * self.fixed_forces).sum()
        return self.compute_cost(forces) + float((multipliers * forces).sum() - support)


def track_under_cap(
    problem: TrackingProblem,
    reference: FloatArray,
    cap_n: float,
    already_planned: FloatArray | None = None,
    settings: CapSettings | None = None,
) -> CappedForces:
    """Track reference (N, p), m/s², from rest. cap_n: largest norm of a row of all forces, N; already_planned: (N, m),
    N, further forces, such as those of other bands, which count against the cap (None = none). Raises TrackingError for
    other shapes, where `already_planned` alone is above the cap, and where the duality gap is not reached within the
    allowed rounds; ValueError for an invalid cap."""
    r = require_trajectory(problem, reference)
    fixed_forces = (
        np.zeros((len(r), problem.inputs)) if already_planned is None else np.asarray(already_planned, dtype=np.float64)
    )
    if fixed_forces.shape != (len(r), problem.inputs):
        raise TrackingError(
            f"the other forces have shape {fixed_forces.shape}; it must be ({len(r)}, {problem.inputs})"
        )
    peaks = find_force_peaks(fixed_forces, require_cap(cap_n))
    if not peaks.is_under_cap:
        raise TrackingError(
            f"the other forces alone reach {peaks.peak_n:.3g} N at row {peaks.peak_row}, above the cap of {cap_n:g} "
            "N; lower them, or raise the cap"
        )
    capped_problem = _CappedProblem(problem, r, fixed_forces, cap_n)
    unconstrained = track(compute_stored_gains(problem, len(r)), r)
    if find_force_peaks(unconstrained.forces + fixed_forces, cap_n).is_under_cap:
        return _make_result(capped_problem, unconstrained.forces, unconstrained.forces, 0.0, 0)
    return _make_result(
        capped_problem,
        unconstrained.forces,
        *_alternate_directions(capped_problem, unconstrained.forces, settings or CapSettings()),
    )


def _alternate_directions(
    capped_problem: _CappedProblem, initial_forces: FloatArray, settings: CapSettings
) -> tuple[FloatArray, float, int]:
    """Solve by ADMM with over-relaxation, in Boyd's notation: u from tracking, z projected on the cap, scaled
    multipliers λ / (2 penalty). Returns the best z, its relative duality gap and the number of rounds. Raises
    TrackingError where the gap is not reached."""
    penalty = _choose_initial_penalty(capped_problem.problem)
    gains = _compute_penalised_gains(capped_problem.problem, len(capped_problem.reference), penalty)
    z, scaled_multipliers = capped_problem.project(initial_forces), np.zeros_like(initial_forces)
    best_forces, best_cost, cost_bound, gap = z, capped_problem.compute_cost(z), -np.inf, np.inf
    for round_count in range(1, settings.rounds + 1):
        u = track(gains, np.hstack((capped_problem.reference, z - scaled_multipliers))).forces
        cost_bound = max(cost_bound, capped_problem.compute_lower_bound(u, 2 * penalty * (u - z + scaled_multipliers)))
        relaxed_forces = OVER_RELAXATION * u + (1 - OVER_RELAXATION) * z
        previous_z, z = z, capped_problem.project(relaxed_forces + scaled_multipliers)
        scaled_multipliers = scaled_multipliers + relaxed_forces - z
        cost = capped_problem.compute_cost(z)
        if cost < best_cost:
            best_forces, best_cost = z, cost
        gap = max(0.0, (best_cost - cost_bound) / best_cost)
        if gap <= settings.gap:
            return best_forces, gap, round_count
        factor = _compute_penalty_factor(u - z, z - previous_z) if round_count % ROUNDS_BETWEEN_TUNING == 0 else 1.0
        if factor != 1.0:
            penalty, scaled_multipliers = penalty * factor, scaled_multipliers / factor
            gains = _compute_penalised_gains(capped_problem.problem, len(capped_problem.reference), penalty)
    raise TrackingError(
        f"after {settings.rounds} rounds the forces under the cap of {capped_problem.cap_n:g} N are only known to be "
        f"within {gap:.2g} of the best cost; scale the reference down, or allow a larger gap than {settings.gap:g}"
    )


def _compute_penalty_factor(primal_residual: FloatArray, dual_residual: FloatArray) -> float:
    """Compute the factor on the penalty that balances the primal residual u - z and the dual residual, the change of z
    (Boyd et al., section 3.4.1): the square root of their ratio, limited to 0.2 to 5, and 1 for a ratio between 1/3 and
    3. The limits are chosen."""
    ratio = float(
        np.linalg.norm(primal_residual) / max(float(np.linalg.norm(dual_residual)), np.finfo(np.float64).tiny)
    )
    return float(np.clip(np.sqrt(ratio), 0.2, 5.0)) if not 1 / 3 < ratio < 3 else 1.0


def _choose_initial_penalty(problem: TrackingProblem) -> float:
    """Choose the initial penalty: geometric mean of the smallest force weight and the cost's curvature in the force of
    one tick, with lower limits of 1e-6 and 1 (chosen), so that it is above zero."""
    curvature = problem.stage_cost[problem.order :, problem.order :]
    return float(np.sqrt(max(np.linalg.eigvalsh(problem.R)[0], 1e-6) * max(np.trace(curvature), 1.0)))


def _compute_penalised_gains(problem: TrackingProblem, samples: int, penalty: float) -> StoredGains:
    """Compute the gains of the problem with the additional cost penalty |u - w|²: the forces are further tracked
    outputs, and w is their reference."""
    p, m = problem.outputs, problem.inputs
    C = np.insert(problem.C, [p] * m, np.zeros((m, problem.order)), axis=0)
    D = np.insert(problem.D, [p] * m, np.eye(m), axis=0)
    Q = block_diag(problem.Q[:p, :p], penalty * np.eye(m), problem.Q[p:, p:])
    return compute_stored_gains(replace(problem, C=C, D=D, Q=Q, outputs=p + m), samples)


def _simulate_outputs(problem: TrackingProblem, forces: FloatArray) -> FloatArray:
    """Simulate all q outputs, (N, q), the p tracked outputs first, under forces (N, m) from rest."""
    outputs, forces_out = np.empty((len(forces), problem.C.shape[0])), np.empty_like(forces)
    all_outputs_step = replace(problem, outputs=problem.C.shape[0]).step
    no_gain = np.zeros((len(forces), problem.inputs, problem.order))
    simulate(all_outputs_step, no_gain, np.ascontiguousarray(forces), np.zeros(problem.order), forces_out, outputs)
    return outputs


def _make_result(
    capped_problem: _CappedProblem, unconstrained: FloatArray, forces: FloatArray, gap: float, rounds: int
) -> CappedForces:
    """Make the result for `forces` (N, m), with the loss against the forces `unconstrained` (N, m). gap, rounds: as in
    `TrackingLoss`."""
    p, reference_norm = capped_problem.problem.outputs, float(np.linalg.norm(capped_problem.reference)) or 1.0

    def compute_error(tested_forces: FloatArray) -> float:
        """Compute the relative rms tracking error of forces (N, m); the absolute norm for a reference of zeros."""
        return (
            float(
                np.linalg.norm(
                    _simulate_outputs(capped_problem.problem, tested_forces)[:, :p] - capped_problem.reference
                )
            )
            / reference_norm
        )

    loss = TrackingLoss(
        compute_error(unconstrained),
        compute_error(forces),
        compute_error(capped_problem.project(unconstrained)),
        capped_problem.compute_cost(unconstrained),
        capped_problem.compute_cost(forces),
        gap,
        rounds,
    )
    return CappedForces(forces, _simulate_outputs(capped_problem.problem, forces)[:, :p], loss)
