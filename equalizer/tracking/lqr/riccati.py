"""Riccati recursion of the linear-quadratic tracker, square-root form: with a factor S of P = S'S (equations in `lqr`).

The gains depend on model, weights and length, not on the trajectory. Bryson and Ho, Applied Optimal Control, chapter 5,
with feedthrough; as an array algorithm (Kailath, Sayed and Hassibi, Linear Estimation, chapter 12) with one QR
decomposition per step from S of sample k + 1 to S- of sample k, with U orthogonal, T upper triangular, and W here T'⁻¹
times the W of `lqr`:

    [ R½    0   ]       [ T   W  ]
    [ Q½ D  Q½ C]  =  U [ 0   S- ]      H = T'T,   K = T⁻¹ W,   P- = S-' S-
    [ S B   S A ]

P therefore has no negative eigenvalue, even where the forces can cancel the whole cost. `riccati_kernel` updates P
itself, compiled: faster, but less accurate. `lqr.compute_stored_gains` runs that kernel first, and this recursion where
the kernel is not accurate enough; `preview` calls `compute_stationary_gains`.
"""

from dataclasses import dataclass

import numpy as np
from scipy.linalg import LinAlgError, solve_discrete_are, solve_triangular

from equalizer.signals.signal import FloatArray
from equalizer.tracking.lqr.tracking_problem import TrackingError, TrackingProblem, copy_read_only

NO_CURVATURE_MESSAGE = (
    "at step {step} from the end a force has no effect on what is penalised: with a delay or without feedthrough "
    "the force weight must be above zero"
)
"""Text of the error for a singular H (no curvature of the cost in a force). step: number of steps to the end."""

NOT_STATIONARY_MESSAGE = (
    "there are no stationary gains: states that the forces cannot control must decay without control, and with a "
    "delay or without feedthrough the force weight must be above zero"
)
"""Text of the error where the algebraic Riccati equation has no stabilising solution."""
RANK_TOLERANCE = 1e-14
"""Rank tolerance, relative to the norm of a column of the array: a column whose part orthogonal to the columns before
it is smaller counts as linearly dependent on them, up to rounding. Chosen near the precision of 64-bit floats."""
EIGENVALUE_TOLERANCE = 1e-9
"""Tolerance for negative eigenvalues, relative to a weight's largest entry (rounding of a solved Riccati equation).
Chosen."""
STATIONARITY_TOLERANCE = 1e-6
"""Largest change of a stationary P in a further step of the recursion, relative to its largest entry. Chosen."""


@dataclass(frozen=True, slots=True, eq=False)
class Gains:
    """Gains of u_k = H_k⁻¹ t_k - K_k x_k, where t_k = D'Q r_k + B' v_{k+1} depends on the remaining trajectory. The
    arrays are read-only; N steps, or N = 1 for stationary gains."""

    K: FloatArray
    """(N, m, n)"""
    H_inverse: FloatArray
    """(N, m, m)"""
    P: FloatArray
    """(n, n): P_0; x' P_0 x is the optimal cost from the initial state x with zero reference."""

    def __post_init__(self) -> None:
        for name in ("K", "H_inverse", "P"):
            object.__setattr__(self, name, copy_read_only(getattr(self, name)))

    def __len__(self) -> int:
        return int(self.K.shape[0])


def compute_backward_gains(problem: TrackingProblem, samples: int, terminal_weight: FloatArray | None = None) -> Gains:
    """Compute the gains of `samples` steps by the square-root recursion. terminal_weight: P_N, (n, n), weight of x_N -
    x_f; None = free final state. Raises TrackingError where a force, or a combination of forces, has no effect on the
    cost, and for an invalid terminal weight."""
    n, m = problem.order, problem.inputs
    S = _factorize(require_terminal_weight(problem, terminal_weight))
    K, H_inverse = np.empty((samples, m, n)), np.empty((samples, m, m))
    input_and_state_matrix = np.hstack((problem.B, problem.A))
    stage_factor = np.vstack(
        (_factorize(problem.R) @ np.eye(m, m + n), _factorize(problem.Q) @ np.hstack((problem.D, problem.C)))
    )
    for k in range(samples - 1, -1, -1):
        pre_array = np.vstack((stage_factor, S @ input_and_state_matrix))
        post_array = np.asarray(np.linalg.qr(pre_array, mode="r"))
        T, S = post_array[:m, :m], post_array[m:, m:]
        # |T_jj| over the norm of column j of `pre_array`: the share of the column that is orthogonal to the
        # columns before it. Zero up to rounding: a combination of these forces has no effect on the cost.
        if not np.all(np.abs(np.diag(T)) > RANK_TOLERANCE * np.linalg.norm(pre_array[:, :m], axis=0)):
            raise TrackingError(NO_CURVATURE_MESSAGE.format(step=samples - k))
        K[k] = solve_triangular(T, post_array[:m, m:])
        T_inverse = solve_triangular(T, np.eye(m))
        H_inverse[k] = T_inverse @ T_inverse.T
    return Gains(K, H_inverse, S.T @ S)


def compute_stationary_gains(problem: TrackingProblem) -> Gains:
    """Compute the gains of the infinite horizon as a single step (N = 1), by the discrete algebraic Riccati equation.
    Raises TrackingError where it has no stabilising solution, or a further step of the recursion changes the
    solution."""
    A, B, C, D, Q, R = problem.A, problem.B, problem.C, problem.D, problem.Q, problem.R
    try:
        P = solve_discrete_are(A, B, C.T @ Q @ C, R + D.T @ Q @ D, s=C.T @ Q @ D)
        gains = compute_backward_gains(problem, 1, (P + P.T) / 2)
    except (LinAlgError, ValueError) as error:
        raise TrackingError(NOT_STATIONARY_MESSAGE) from error
    is_stable = np.abs(np.linalg.eigvals(A - B @ gains.K[0])).max(initial=0.0) < 1
    if not (is_stable and np.abs(gains.P - P).max(initial=0.0) <= STATIONARITY_TOLERANCE * np.abs(P).max(initial=0.0)):
        raise TrackingError(NOT_STATIONARY_MESSAGE)
    return gains


def require_terminal_weight(problem: TrackingProblem, terminal_weight: FloatArray | None) -> FloatArray:
    """Return P_N, (n, n), made exactly symmetric; zeros for None. Raises TrackingError for another shape, values that
    are not finite, asymmetry beyond rounding (1e-9, relative) and an eigenvalue below zero by more than
    `EIGENVALUE_TOLERANCE`."""
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
    P = (P + P.T) / 2
    lowest_eigenvalue = float(np.linalg.eigvalsh(P)[0]) if n else 0.0
    if lowest_eigenvalue < -EIGENVALUE_TOLERANCE * float(np.abs(P).max(initial=0.0)):
        raise TrackingError(f"terminal_weight has the eigenvalue {lowest_eigenvalue:g}; none may be negative")
    return P


def _factorize(weight: FloatArray) -> FloatArray:
    """Factorize a symmetric matrix, F'F = weight, by its eigenvalues; those below zero are rounding errors and count as
    zero. The weight is scaled to a unit diagonal first: the states of a model differ in unit and size, and rounding
    errors of a large weight must not hide a small weight."""
    diagonal_root = np.sqrt(np.maximum(np.diag(weight), 0.0))
    scale = np.where(diagonal_root > 0, diagonal_root, 1.0)
    eigenvalues, eigenvectors = np.linalg.eigh(weight / np.outer(scale, scale))
    factor: FloatArray = np.sqrt(np.maximum(eigenvalues, 0.0))[:, None] * eigenvectors.T * scale
    return factor
