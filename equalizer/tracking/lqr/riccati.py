"""Riccati recursion of the linear-quadratic tracker, written plainly. `riccati_kernel` is the compiled one.

It does not depend on the trajectory: gains of a model, weights and length serve every trajectory of that length.
Bryson and Ho, Applied Optimal Control, chapter 5, with feedthrough.
"""

from dataclasses import dataclass

import numpy as np
from scipy.linalg import LinAlgError, cho_factor, cho_solve, solve_discrete_are

from equalizer.signals.signal import FloatArray
from equalizer.tracking.lqr.tracking_problem import TrackingError, TrackingProblem, read_only

NO_CURVATURE = (
    "at step {step} from the end a force has no effect on what is penalised: with a delay or without feedthrough "
    "the force weight must be above zero"
)

NOT_STATIONARY = (
    "there are no stationary gains: what the forces cannot reach must die away by itself, and with a delay or without "
    "feedthrough the force weight must be above zero"
)
STATIONARY = 1e-6
"""Largest change of stationary P over a further step, relative to its largest entry."""


@dataclass(frozen=True, slots=True, eq=False)
class Gains:
    """u_k = H_k⁻¹ t_k - K_k x_k, with t_k from the trajectory ahead. Read-only arrays."""

    K: FloatArray
    """(N, m, n)"""
    H_inverse: FloatArray
    """(N, m, m)"""
    P: FloatArray
    """(n, n): x' P x is what the best forces cost from the state x at the start, where nothing is wanted."""

    def __post_init__(self) -> None:
        for name in ("K", "H_inverse", "P"):
            object.__setattr__(self, name, read_only(getattr(self, name)))

    def __len__(self) -> int:
        return int(self.K.shape[0])


def backward_gains(problem: TrackingProblem, samples: int, terminal_weight: FloatArray | None = None) -> Gains:
    """Gains for `samples` steps. terminal_weight: P_N, (n, n), of (x_N - x_f); None = the end is free.

    Raises TrackingError where a force has no effect on the cost.
    """
    n, m = problem.order, problem.inputs
    P = require_terminal_weight(problem, terminal_weight)
    K, H_inverse = np.empty((samples, m, n)), np.empty((samples, m, m))
    A, B, C, D, Q, R = problem.A, problem.B, problem.C, problem.D, problem.Q, problem.R
    for k in range(samples - 1, -1, -1):
        H = R + D.T @ Q @ D + B.T @ P @ B
        F = D.T @ Q @ C + B.T @ P @ A
        try:
            factor = cho_factor((H + H.T) / 2)
        except LinAlgError as error:
            raise TrackingError(NO_CURVATURE.format(step=samples - k)) from error
        K[k] = cho_solve(factor, F)
        H_inverse[k] = cho_solve(factor, np.eye(m))
        P = C.T @ Q @ C + A.T @ P @ A - F.T @ K[k]
        P = (P + P.T) / 2
    return Gains(K, H_inverse, P)


def stationary_gains(problem: TrackingProblem) -> Gains:
    """Gains far from the end, as one step (N = 1). Raises TrackingError where there are none."""
    A, B, C, D, Q, R = problem.A, problem.B, problem.C, problem.D, problem.Q, problem.R
    try:
        P = solve_discrete_are(A, B, C.T @ Q @ C, R + D.T @ Q @ D, s=C.T @ Q @ D)
        gains = backward_gains(problem, 1, (P + P.T) / 2)
    except (LinAlgError, ValueError) as error:
        raise TrackingError(NOT_STATIONARY) from error
    steady = np.abs(np.linalg.eigvals(A - B @ gains.K[0])).max(initial=0.0) < 1
    if not (steady and np.abs(gains.P - P).max(initial=0.0) <= STATIONARY * np.abs(P).max(initial=0.0)):
        raise TrackingError(NOT_STATIONARY)
    return gains


def require_terminal_weight(problem: TrackingProblem, terminal_weight: FloatArray | None) -> FloatArray:
    """P_N, (n, n), symmetric; zeros where None. Raises TrackingError."""
    n = problem.order
    if terminal_weight is None:
        return np.zeros((n, n))
    P = np.ascontiguousarray(terminal_weight, dtype=np.float64)
    if (
        P.shape != (n, n)
        or not np.isfinite(P).all()
        or not np.allclose(P, P.T, rtol=1e-9, atol=1e-12 * np.abs(P).max())
    ):
        raise TrackingError(f"terminal_weight must be a symmetric matrix of finite numbers of shape ({n}, {n})")
    return (P + P.T) / 2
