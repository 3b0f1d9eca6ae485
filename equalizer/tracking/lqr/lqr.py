"""Finite-horizon linear-quadratic tracking: feedforward forces from gains that are computed once.

Theory of operation. The forces u minimise, for the model x_{k+1} = A x_k + B u_k, y_k = C x_k + D u_k,

    J = sum over k < N of (y_k - r_k)' Q (y_k - r_k) + u_k' R u_k, plus (x_N - x_f)' P_N (x_N - x_f)

By dynamic programming the cost from sample k on is x' P_k x - 2 x' v_k + a constant, with, backwards in time,

    H_k = R + D'Q D + B' P_{k+1} B              W_k = D'Q C + B' P_{k+1} A              K_k = H_k^-1 W_k
    P_k = C'Q C + A' P_{k+1} A - W_k' K_k       v_k = (C - D K_k)' Q r_k + (A - B K_k)' v_{k+1},  v_N = P_N x_f
    u_k = g_k - K_k x_k                         g_k = H_k^-1 (D'Q r_k + B' v_{k+1})

P, H and K do not depend on the trajectory r (`riccati`): `compute_stored_gains` computes them once for a length N. For
each trajectory, a backward pass gives v and g (`compute_costate_feedforward`), and a forward pass simulates the model
and gives the forces (`track`). Both passes are linear in r, which `rotation` uses.

No measured signal is fed back: K_k x_k, a part of the force, acts on the state of the simulated model.

References: Bryson and Ho, Applied Optimal Control (1975), chapter 5; Anderson and Moore, Optimal Control: Linear
Quadratic Methods (1990), chapter 4. The tests compute the same forces by one dense least-squares problem
(`tests/equalizer/tracking/lqr/dense_least_squares.py`). Exported as `equalizer.stored_gains` and `equalizer.track`.
"""

from dataclasses import dataclass

import numpy as np
from scipy.linalg import solve_discrete_lyapunov

from equalizer.signals.signal import FloatArray
from equalizer.tracking.lqr import lqr_kernel, riccati_kernel
from equalizer.tracking.lqr.riccati import Gains, compute_backward_gains, require_terminal_weight
from equalizer.tracking.lqr.tracking_problem import TrackingError, TrackingProblem, copy_read_only, require_trajectory


@dataclass(frozen=True, slots=True, eq=False)
class StoredGains:
    """Gains for all trajectories of N samples and all initial states of a problem. Made by `compute_stored_gains`."""

    problem: TrackingProblem
    gains: Gains
    terminal_weight: FloatArray
    """P_N, (n, n): weight of the final state's deviation; zeros = free final state."""

    def __len__(self) -> int:
        return len(self.gains)


@dataclass(frozen=True, slots=True, eq=False)
class TrackResult:
    """Optimal forces for a trajectory, and the model's response to them; result of `track` and
    `preview.track_stream`."""

    forces: FloatArray
    """(N, m), N: one row per row of the trajectory."""
    predicted: FloatArray
    """(N, p), m/s²: the model's response."""
    final_state: FloatArray
    """(n,): state of the model after the last row."""


def compute_stored_gains(
    problem: TrackingProblem, samples: int, terminal_weight: FloatArray | None = None
) -> StoredGains:
    """Compute the gains of `samples` steps by the Riccati recursion, in the compiled kernel unless rounding errors
    forbid it. terminal_weight: P_N, (n, n), weight of x_N - x_f; None = free final state. Raises TrackingError for less
    than one sample, an invalid terminal weight, and a force without effect on the cost."""
    if samples < 1:
        raise TrackingError(f"a horizon has {samples} samples; it needs one or more")
    n, m = problem.order, problem.inputs
    terminal = require_terminal_weight(problem, terminal_weight)
    P, K, H_inverse = terminal.copy(), np.empty((samples, m, n)), np.empty((samples, m, m))
    is_accurate = riccati_kernel.run_backward_recursion(problem.dynamics, problem.stage_cost, P, K, H_inverse)
    gains = Gains(K, H_inverse, P) if is_accurate else compute_backward_gains(problem, samples, terminal)
    return StoredGains(problem, gains, copy_read_only(terminal))


def track(
    gains: StoredGains, reference: FloatArray, x0: FloatArray | None = None, final_state: FloatArray | None = None
) -> TrackResult:
    """Track reference (N, p), m/s², with N the length of the gains. x0: (n,), the model's state before the first row;
    None = at rest. final_state: x_f, (n,), target of the final state if the gains have a terminal weight (without one
    it has no effect); None = rest. Raises TrackingError for other shapes and values that are not finite."""
    problem, g = gains.problem, compute_costate_feedforward(gains, reference, final_state)
    x = problem.make_state(x0).copy()
    forces, predicted = np.empty_like(g), np.empty((len(g), problem.outputs))
    lqr_kernel.simulate(problem.step, gains.gains.K, g, x, forces, predicted)
    return TrackResult(forces, predicted, x)


def compute_costate_feedforward(
    gains: StoredGains, reference: FloatArray, final_state: FloatArray | None = None
) -> FloatArray:
    """Compute g of u = g - K x, (N, m), N: the feedforward from the remaining trajectory. Linear in `reference` and
    `final_state`. Raises TrackingError as `track`."""
    problem = gains.problem
    r = require_trajectory(problem, reference)
    if len(r) != len(gains):
        raise TrackingError(f"the trajectory has {len(r)} samples, but the gains are for {len(gains)}")
    v = gains.terminal_weight @ problem.make_state(final_state)
    g = np.empty((len(r), problem.inputs))
    lqr_kernel.compute_feedforward(
        problem.dynamics, r @ problem.linear_cost, gains.gains.K, gains.gains.H_inverse, v, g
    )
    return g


def compute_periodic_state(problem: TrackingProblem, forces: FloatArray) -> FloatArray:
    """Compute the state (n,) at the first row of forces (T, m), N, that repeat with period T, in the steady state. A
    fade-in that ends in this state continues into the periodic forces without a transient
    (`feedforward.model_equalizer`). Raises TrackingError for an unstable model."""
    require_stable(problem, "repeated forces lead to no periodic state")
    x = np.zeros(problem.order)
    for force in np.asarray(forces, dtype=np.float64):
        x = problem.A @ x + problem.B @ force
    state_change = np.eye(problem.order) - np.linalg.matrix_power(problem.A, len(forces))
    return np.asarray(np.linalg.solve(state_change, x))


def compute_free_decay_weight(problem: TrackingProblem) -> FloatArray:
    """Compute the terminal weight P_N, (n, n), that includes the free decay after the end, the observability Gramian of
    A and Q½ C. A final state that differs by d from the intended state causes, with the intended forces from then on
    (zero after a transient, periodic after a fade-in), output errors with the cost d' P_N d. Raises TrackingError for
    an unstable model."""
    require_stable(problem, "the motion after the end does not decay")
    return np.asarray(solve_discrete_lyapunov(problem.A.T, problem.C.T @ problem.Q @ problem.C))


def require_stable(problem: TrackingProblem, consequence: str) -> None:
    """Check that all eigenvalues of A are within the unit circle. Raises TrackingError, whose text ends with
    `consequence`."""
    spectral_radius = float(np.abs(np.linalg.eigvals(problem.A)).max(initial=0.0))
    if spectral_radius >= 1:
        raise TrackingError(f"the model is not stable (spectral radius {spectral_radius:.6g}), so that {consequence}")
