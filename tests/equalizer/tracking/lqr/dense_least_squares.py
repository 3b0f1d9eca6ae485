"""Reference solution of the trackers: the same cost as a dense least-squares problem with a block-Toeplitz matrix."""

import numpy as np
from scipy.linalg import solve_triangular

from equalizer.signals.signal import FloatArray
from equalizer.tracking.lqr.riccati import require_terminal_weight
from equalizer.tracking.lqr.tracking_problem import TrackingProblem, require_trajectory


def least_squares_forces(
    problem: TrackingProblem,
    wanted: FloatArray,
    x0: FloatArray | None = None,
    terminal_weight: FloatArray | None = None,
    final_state: FloatArray | None = None,
) -> FloatArray:
    """Optimal forces (N, m); arguments as of `track`, which must find the same. Time grows with N³, memory with N²."""
    r = require_trajectory(problem, wanted)
    N, q = len(r), problem.C.shape[0]
    free, to_end = _free_response(problem, N, problem.make_state(x0))
    missing = -free
    missing[:, : problem.outputs] += r
    output_root, force_root = _matrix_root(problem.Q), _matrix_root(problem.R)
    end_root = _matrix_root(require_terminal_weight(problem, terminal_weight))
    T = block_toeplitz(problem, N).reshape(N, q, -1)
    rows = [np.einsum("ij,njk->nik", output_root, T).reshape(N * q, -1), np.kron(np.eye(N), force_root)]
    rows.append(end_root @ _reachability_matrix(problem, N))
    right = [(missing @ output_root.T).ravel(), np.zeros(N * problem.inputs)]
    right.append(end_root @ (problem.make_state(final_state) - to_end))
    Qr, Rr = np.linalg.qr(np.vstack(rows))
    return np.asarray(solve_triangular(Rr, Qr.T @ np.concatenate(right))).reshape(N, problem.inputs)


def block_toeplitz(problem: TrackingProblem, samples: int) -> FloatArray:
    """Block-Toeplitz matrix (N q, N m) from all forces to all outputs of a model at rest."""
    q, m = problem.D.shape
    T = np.zeros((samples, q, samples, m))
    response, state = problem.D, problem.B
    for lag in range(samples):
        rows = np.arange(lag, samples)
        T[rows, :, rows - lag, :] = response
        response, state = problem.C @ state, problem.A @ state
    return T.reshape(samples * q, samples * m)


def _free_response(problem: TrackingProblem, samples: int, x: FloatArray) -> tuple[FloatArray, FloatArray]:
    outputs = np.empty((samples, problem.C.shape[0]))
    for k in range(samples):
        outputs[k] = problem.C @ x
        x = problem.A @ x
    return outputs, x


def _reachability_matrix(problem: TrackingProblem, samples: int) -> FloatArray:
    """(n, N m): from all forces to the state after the last."""
    blocks = [problem.B]
    for _ in range(samples - 1):
        blocks.append(problem.A @ blocks[-1])
    return np.hstack(blocks[::-1])


def _matrix_root(weight: FloatArray) -> FloatArray:
    """W with W' W = weight."""
    values, vectors = np.linalg.eigh(weight)
    return np.asarray(np.sqrt(np.clip(values, 0, None))[:, np.newaxis] * vectors.T)
