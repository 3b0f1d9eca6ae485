"""Riccati recursion of the linear-quadratic tracker with P itself, compiled; abandoned where rounding errors matter.

The equations are those of `lqr`, whose W_k is F here, with the Cholesky factor L of H:

    M = [A B]' P_{k+1} [A B] + stage cost = [M_xx F'; F H],    H = L L',    W = L⁻¹ F
    P_k = M_xx - W'W,    K_k = L'⁻¹ W

Where the forces can cancel nearly all of the cost (feedthrough without force weight), P_k is a difference of nearly
equal numbers: rounding may leave a negative eigenvalue, which each further step multiplies by the square of the model's
unstable zeros. `riccati.compute_backward_gains`, which updates a factor of P, is used then. All compiled functions that
the recursion calls are in this file, because numba invalidates its cache by file.
"""

import numpy as np
from numba import njit, types

from equalizer.signals.signal import FloatArray

_MATRIX = types.Array(types.float64, 2, "C", readonly=True)
_OUTPUT_MATRIX = types.float64[:, ::1]
_STACK = types.float64[:, :, ::1]
CANCELLATION_LIMIT = float(np.sqrt(np.finfo(np.float64).eps))
"""Ratio of a difference to its minuend below which more than half of the digits are lost by cancellation."""


@njit(types.boolean(_OUTPUT_MATRIX, types.int64), cache=True, nogil=True)
def _factorise_in_place(M: FloatArray, n: int) -> bool:
    """Factorise H (Cholesky) and substitute forward, in place: the last rows of M, [F H], become [W L] with L L' = H
    and L W = F. M: (n + m, n + m). Of H, only the lower triangle is read. Returns False where H is not positive
    definite beyond rounding."""
    for i in range(n, M.shape[0]):
        pivot = M[i, i]
        for j in range(n, i):
            for c in range(n, j):
                M[i, j] -= M[i, c] * M[j, c]
            M[i, j] /= M[j, j]
            M[i, i] -= M[i, j] * M[i, j]
        # A pivot this small, relative to its entry of H, consists of rounding errors.
        if not M[i, i] > 1e-15 * pivot:
            return False
        M[i, i] = M[i, i] ** 0.5
        for j in range(n, i):
            for c in range(n):
                M[i, c] -= M[i, j] * M[j, c]
        for c in range(n):
            M[i, c] /= M[i, i]
    return True


@njit(types.void(_OUTPUT_MATRIX, types.int64, _OUTPUT_MATRIX, _OUTPUT_MATRIX), cache=True, nogil=True)
def _compute_gain_and_inverse(M: FloatArray, n: int, K: FloatArray, H_inverse: FloatArray) -> None:
    """Fill K = L'⁻¹ W, (m, n), and H⁻¹ = L'⁻¹ L⁻¹, (m, m), from the result of `_factorise_in_place`."""
    m = M.shape[0] - n
    for i in range(m):
        for c in range(m):
            value = 1.0 if i == c else 0.0
            for j in range(i):
                value -= M[n + i, n + j] * H_inverse[j, c]
            H_inverse[i, c] = value / M[n + i, n + i]
    for i in range(m - 1, -1, -1):
        K[i, :] = M[n + i, :n]
        for j in range(i + 1, m):
            for c in range(n):
                K[i, c] -= M[n + j, n + i] * K[j, c]
            for c in range(m):
                H_inverse[i, c] -= M[n + j, n + i] * H_inverse[j, c]
        for c in range(n):
            K[i, c] /= M[n + i, n + i]
        for c in range(m):
            H_inverse[i, c] /= M[n + i, n + i]


@njit(types.void(_MATRIX, _MATRIX, _OUTPUT_MATRIX, _OUTPUT_MATRIX), cache=True, nogil=True)
def _compute_cost_to_go(AB: FloatArray, stage_cost: FloatArray, P: FloatArray, M: FloatArray) -> None:
    """Fill M = [A B]' P [A B] + stage_cost, (n + m, n + m)."""
    np.dot(AB.T, np.dot(P, AB), M)
    M += stage_cost


@njit(types.boolean(_OUTPUT_MATRIX, types.int64, _OUTPUT_MATRIX), cache=True, nogil=True)
def _update_weight(M: FloatArray, n: int, P: FloatArray) -> bool:
    """Fill P = M[:n, :n] - W' W, (n, n), exactly symmetric; the lower triangle of M[:n, :n] is overwritten. Returns
    False where a diagonal entry lost more than half of its digits by cancellation."""
    is_accurate = True
    for i in range(n):
        minuend = M[i, i]
        for j in range(n, M.shape[0]):
            for c in range(i + 1):
                M[i, c] -= M[j, i] * M[j, c]
        for c in range(i + 1):
            P[i, c] = M[i, c]
            P[c, i] = M[i, c]
        is_accurate &= P[i, i] >= CANCELLATION_LIMIT * minuend
    return is_accurate


@njit(types.boolean(_MATRIX, _MATRIX, _OUTPUT_MATRIX, _STACK, _STACK), cache=True, nogil=True)
def run_backward_recursion(
    AB: FloatArray, stage_cost: FloatArray, P: FloatArray, K: FloatArray, H_inverse: FloatArray
) -> bool:
    """Fill K (N, m, n) and H_inverse (N, m, m) backward from the terminal weight P (n, n), which is overwritten by P_0.

    AB: [A B], (n, n + m); stage_cost: (n + m, n + m). Returns False, with incomplete results, where a force has no
    effect on the cost at some step, or rounding errors matter.
    """
    n, step_count = P.shape[0], K.shape[0]
    M = np.empty_like(stage_cost)
    for k in range(step_count - 1, -1, -1):
        _compute_cost_to_go(AB, stage_cost, P, M)
        if not _factorise_in_place(M, n):
            return False
        _compute_gain_and_inverse(M, n, K[k], H_inverse[k])
        if not _update_weight(M, n, P):
            return False
    return True
