"""Compiled passes of the finite-horizon LQR tracker with stored gains; equations and symbols are those of `lqr`.

`compute_feedforward`: backward pass, costate v and feedforward g. `simulate`: forward pass, model and forces.
`simulate_tick`: one time step of the forward pass, for a direction that may change at each step; `simulate_ticks`: many
steps. Called by `lqr`, `preview`, `constrained` and `changing_direction`. n: order, m: forces, p: outputs; z = [x, u]:
state and forces; s: result of a product with a matrix.
"""

import numpy as np
from numba import njit, types

from equalizer.signals.signal import FloatArray

_VECTOR = types.float64[::1]
_INPUT_VECTOR = types.Array(types.float64, 1, "C", readonly=True)
_MATRIX = types.Array(types.float64, 2, "C", readonly=True)
_STACK = types.Array(types.float64, 3, "C", readonly=True)
_OUTPUT_MATRIX = types.float64[:, ::1]
# _VECTOR and _OUTPUT_MATRIX may be written; the others are read-only inputs. All are contiguous.


@njit(types.void(_VECTOR, _MATRIX, _VECTOR), cache=True, nogil=True, fastmath={"reassoc", "contract"})
def _add_product(z: FloatArray, matrix: FloatArray, s: FloatArray) -> None:
    """Add z[:rows] @ matrix to s, (columns,), in place; z may be longer. Four rows at a time, because s is then loaded
    and stored a quarter as often."""
    rows, columns = matrix.shape
    unrolled_rows = rows - rows % 4
    for j in range(0, unrolled_rows, 4):
        z0, z1, z2, z3 = z[j], z[j + 1], z[j + 2], z[j + 3]
        for c in range(columns):
            s[c] += matrix[j, c] * z0 + matrix[j + 1, c] * z1 + matrix[j + 2, c] * z2 + matrix[j + 3, c] * z3
    for j in range(unrolled_rows, rows):
        for c in range(columns):
            s[c] += matrix[j, c] * z[j]


@njit(types.void(_MATRIX, _MATRIX, _STACK, _STACK, _VECTOR, _OUTPUT_MATRIX), cache=True, nogil=True)
def compute_feedforward(
    AB: FloatArray, linear_costs: FloatArray, K: FloatArray, H_inverse: FloatArray, v: FloatArray, g: FloatArray
) -> None:
    """Fill g (N, m), the feedforward of the forces. v: (n,), costate after the last row; overwritten by the costate at
    the first row. AB: [A B], (n, n + m); linear_costs: r' Q [C D] of each row, (N, n + m); K: (N, m, n), feedback
    gains; H_inverse: (N, m, m)."""
    n, m = AB.shape[0], g.shape[1]
    s = np.empty(n + m)
    for k in range(g.shape[0] - 1, -1, -1):
        for c in range(n + m):
            s[c] = linear_costs[k, c]
        _add_product(v, AB, s)
        for c in range(n):
            v[c] = s[c]
        for i in range(m):
            g[k, i] = 0.0
            for j in range(m):
                g[k, i] += H_inverse[k, i, j] * s[n + j]
            for c in range(n):
                v[c] -= K[k, i, c] * s[n + i]


@njit(
    types.void(_MATRIX, _STACK, _MATRIX, _VECTOR, _OUTPUT_MATRIX, _OUTPUT_MATRIX),
    cache=True,
    nogil=True,
    fastmath={"reassoc", "contract"},
)
def simulate(
    step: FloatArray, K: FloatArray, g: FloatArray, x: FloatArray, forces: FloatArray, predicted: FloatArray
) -> None:
    """Fill forces (N, m), u = g - K x, and predicted (N, p). x: (n,), state at the start; overwritten by the state at
    the end. step: [A B; C D]', (n + m, n + p); K: (N, m, n); g: (N, m)."""
    m, n = K.shape[1], K.shape[2]
    z, s = np.empty(n + m), np.empty(step.shape[1])
    z[:n] = x
    for k in range(g.shape[0]):
        for i in range(m):
            feedback = 0.0
            for c in range(n):
                feedback += K[k, i, c] * z[c]
            z[n + i] = g[k, i] - feedback
        s[:] = 0.0
        _add_product(z, step, s)
        for i in range(m):
            forces[k, i] = z[n + i]
        for i in range(predicted.shape[1]):
            predicted[k, i] = s[n + i]
        for c in range(n):
            z[c] = s[c]
    x[:] = z[:n]


@njit(
    types.void(_MATRIX, _STACK, _STACK, _INPUT_VECTOR, types.int64, _VECTOR),
    cache=True,
    nogil=True,
    fastmath={"reassoc", "contract"},
)
def simulate_tick(
    step: FloatArray, K: FloatArray, g: FloatArray, direction: FloatArray, k: int, work: FloatArray
) -> None:
    """Simulate step k of a transient: u = sum over c of direction_c g_kc - K_k x_k, zero for k >= N. K: (N, m, n); g:
    (N, m, c); direction: (c,); work: (2 n + m + p,), in this order: n numbers, the state, overwritten by the next
    state; m, the force of this step; n, work space; p, the model's response at this step. step: as for `simulate`."""
    m, n = K.shape[1], K.shape[2]
    for i in range(m):
        force = 0.0
        if k < K.shape[0]:
            for c in range(direction.size):
                force += g[k, i, c] * direction[c]
            for c in range(n):
                force -= K[k, i, c] * work[c]
        work[n + i] = force
    s = work[n + m :]
    s[:] = 0.0
    _add_product(work, step, s)
    for c in range(n):
        work[c] = s[c]


@njit(types.void(_MATRIX, _STACK, _STACK, _MATRIX, _VECTOR, _OUTPUT_MATRIX), cache=True, nogil=True)
def simulate_ticks(
    step: FloatArray, K: FloatArray, g: FloatArray, directions: FloatArray, work: FloatArray, outputs: FloatArray
) -> None:
    """Simulate T steps by `simulate_tick`, with the directions (T, c), from row 0 of K and g on. Fill outputs (T, m +
    p): force and response."""
    m, n = K.shape[1], K.shape[2]
    for row in range(directions.shape[0]):
        simulate_tick(step, K, g, directions[row], row, work)
        for i in range(m):
            outputs[row, i] = work[n + i]
        for i in range(outputs.shape[1] - m):
            outputs[row, m + i] = work[2 * n + m + i]
