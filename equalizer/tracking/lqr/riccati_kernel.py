"""The Riccati recursion with P itself, compiled: fast, and abandoned where rounding errors would matter.

P = M[:n, :n] - W'W is a difference of equal numbers where the forces can cancel nearly all of the cost (no force weight
and feedthrough): rounding may leave a negative eigenvalue, and each further step multiplies that by the square of every
unstable zero of the model. `riccati.backward_gains`, which updates a factor of P, is used then. All called functions
are in this file, because numba invalidates its cache by file.
"""

import numpy as np
from numba import njit, types

from equalizer.signals.signal import FloatArray

_MATRIX = types.Array(types.float64, 2, "C", readonly=True)
_OUT = types.float64[:, ::1]
_STACK = types.float64[:, :, ::1]
HALF_OF_THE_DIGITS = float(np.sqrt(np.finfo(np.float64).eps))


@njit(types.boolean(_OUT, types.int64), cache=True, nogil=True)
def _eliminate(M: FloatArray, n: int) -> bool:
    """Turns the last rows of M, [F H], into [W L] with L L' = H and L W = F. Reads H's lower triangle only.

    False = H is not positive.
    """
    for i in range(n, M.shape[0]):
        whole = M[i, i]
        for j in range(n, i):
            for c in range(n, j):
                M[i, j] -= M[i, c] * M[j, c]
            M[i, j] /= M[j, j]
            M[i, i] -= M[i, j] * M[i, j]
        if not M[i, i] > 1e-15 * whole:
            return False
        M[i, i] = M[i, i] ** 0.5
        for j in range(n, i):
            for c in range(n):
                M[i, c] -= M[i, j] * M[j, c]
        for c in range(n):
            M[i, c] /= M[i, i]
    return True


@njit(types.void(_OUT, types.int64, _OUT, _OUT), cache=True, nogil=True)
def _solve(M: FloatArray, n: int, K: FloatArray, H_inverse: FloatArray) -> None:
    """K = L'⁻¹ W and H⁻¹ = L'⁻¹ L⁻¹ from the result of `_eliminate`."""
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


@njit(types.void(_MATRIX, _MATRIX, _OUT, _OUT), cache=True, nogil=True)
def _cost_to_go(joined: FloatArray, stage_cost: FloatArray, P: FloatArray, M: FloatArray) -> None:
    """M = [A B]' P [A B] + the cost of this stage, (n + m, n + m)."""
    np.dot(joined.T, np.dot(P, joined), M)
    M += stage_cost


@njit(types.boolean(_OUT, types.int64, _OUT), cache=True, nogil=True)
def _subtract(M: FloatArray, n: int, P: FloatArray) -> bool:
    """P = M[:n, :n] - W' W, exactly symmetric. False = a diagonal entry lost more than half of its digits by
    cancellation."""
    kept = True
    for i in range(n):
        whole = M[i, i]
        for j in range(n, M.shape[0]):
            for c in range(i + 1):
                M[i, c] -= M[j, i] * M[j, c]
        for c in range(i + 1):
            P[i, c] = M[i, c]
            P[c, i] = M[i, c]
        kept &= P[i, i] >= HALF_OF_THE_DIGITS * whole
    return kept


@njit(types.boolean(_MATRIX, _MATRIX, _OUT, _STACK, _STACK), cache=True, nogil=True)
def backward(joined: FloatArray, stage_cost: FloatArray, P: FloatArray, K: FloatArray, H_inverse: FloatArray) -> bool:
    """Fills K (N, m, n) and H_inverse (N, m, m) backward from P (n, n), which becomes that of the start.

    joined: [A B], (n, n + m); stage_cost: (n + m, n + m). Returns False where a force has no effect on the cost at some
    step, or rounding makes its effect uncertain.
    """
    n, samples = P.shape[0], K.shape[0]
    M = np.empty_like(stage_cost)
    for k in range(samples - 1, -1, -1):
        _cost_to_go(joined, stage_cost, P, M)
        if not _eliminate(M, n):
            return False
        _solve(M, n, K[k], H_inverse[k])
        if not _subtract(M, n, P):
            return False
    return True
