"""Compiled passes of the tracker with stored gains; the equations and symbols are those of `lqr`.

`feedforward`: backward pass, costate v and feedforward g. `simulate`: forward pass, model and forces. `tick`: a single
step of the forward pass, for a direction that may change at each step; `run`: many ticks. n: order, m: forces, p:
outputs.
"""

import numpy as np
from numba import njit, types

from equalizer.signals.signal import FloatArray

_VECTOR = types.float64[::1]
_IN = types.Array(types.float64, 1, "C", readonly=True)
_MATRIX = types.Array(types.float64, 2, "C", readonly=True)
_STACK = types.Array(types.float64, 3, "C", readonly=True)
_OUT = types.float64[:, ::1]
# _VECTOR and _OUT are written; _IN, _MATRIX and _STACK are read-only inputs, all contiguous.


@njit(types.void(_VECTOR, _MATRIX, _VECTOR), cache=True, nogil=True, fastmath={"reassoc", "contract"})
def _add_product(z: FloatArray, matrix: FloatArray, s: FloatArray) -> None:
    """s += z @ matrix, for as many elements of z as matrix has rows. Four rows at a time, because s is then loaded and
    stored a quarter as often."""
    rows, columns = matrix.shape
    whole = rows - rows % 4
    for j in range(0, whole, 4):
        z0, z1, z2, z3 = z[j], z[j + 1], z[j + 2], z[j + 3]
        for c in range(columns):
            s[c] += matrix[j, c] * z0 + matrix[j + 1, c] * z1 + matrix[j + 2, c] * z2 + matrix[j + 3, c] * z3
    for j in range(whole, rows):
        for c in range(columns):
            s[c] += matrix[j, c] * z[j]


@njit(types.void(_MATRIX, _MATRIX, _STACK, _STACK, _VECTOR, _OUT), cache=True, nogil=True)
def feedforward(
    joined: FloatArray, pulled: FloatArray, K: FloatArray, H_inverse: FloatArray, v: FloatArray, g: FloatArray
) -> None:
    """Fill g (N, m), the feedforward of the forces. v: (n,), costate after the last row; overwritten by the costate at
    the first row. joined: [A B], (n, n + m); pulled: r' Q [C D] of each row, (N, n + m)."""
    n, m = joined.shape[0], g.shape[1]
    s = np.empty(n + m)
    for k in range(g.shape[0] - 1, -1, -1):
        for c in range(n + m):
            s[c] = pulled[k, c]
        _add_product(v, joined, s)
        for c in range(n):
            v[c] = s[c]
        for i in range(m):
            g[k, i] = 0.0
            for j in range(m):
                g[k, i] += H_inverse[k, i, j] * s[n + j]
            for c in range(n):
                v[c] -= K[k, i, c] * s[n + i]


@njit(
    types.void(_MATRIX, _STACK, _MATRIX, _VECTOR, _OUT, _OUT), cache=True, nogil=True, fastmath={"reassoc", "contract"}
)
def simulate(
    step: FloatArray, K: FloatArray, g: FloatArray, x: FloatArray, forces: FloatArray, predicted: FloatArray
) -> None:
    """Fill forces (N, m), u = g - K x, and predicted (N, p). x: (n,), state at the start; overwritten by the state at
    the end. step: [A B; C D]', (n + m, n + p)."""
    m, n = K.shape[1], K.shape[2]
    z, s = np.empty(n + m), np.empty(step.shape[1])
    z[:n] = x
    for k in range(g.shape[0]):
        for i in range(m):
            fed_back = 0.0
            for c in range(n):
                fed_back += K[k, i, c] * z[c]
            z[n + i] = g[k, i] - fed_back
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
    types.void(_MATRIX, _STACK, _STACK, _IN, types.int64, _VECTOR),
    cache=True,
    nogil=True,
    fastmath={"reassoc", "contract"},
)
def tick(step: FloatArray, K: FloatArray, g: FloatArray, direction: FloatArray, k: int, live: FloatArray) -> None:
    """Step k of a transient: u = sum over c of direction_c g_kc - K_k x_k; no force after the last row.

    g: (N, m, c); direction: (c,); live: (2 n + m + p,), in this order: n numbers, the state, overwritten by the next
    state; m, the force of this tick; n, work space; p, the model's response at this tick. step: as for `simulate`.
    """
    m, n = K.shape[1], K.shape[2]
    for i in range(m):
        force = 0.0
        if k < K.shape[0]:
            for c in range(direction.size):
                force += g[k, i, c] * direction[c]
            for c in range(n):
                force -= K[k, i, c] * live[c]
        live[n + i] = force
    s = live[n + m :]
    s[:] = 0.0
    _add_product(live, step, s)
    for c in range(n):
        live[c] = s[c]


@njit(types.void(_MATRIX, _STACK, _STACK, _MATRIX, _VECTOR, _OUT), cache=True, nogil=True)
def run(
    step: FloatArray, K: FloatArray, g: FloatArray, directions: FloatArray, live: FloatArray, out: FloatArray
) -> None:
    """`tick` with each of the directions (T, c) in turn, from row 0 of K and g. out: (T, m + p), force and response."""
    m, n = K.shape[1], K.shape[2]
    for row in range(directions.shape[0]):
        tick(step, K, g, directions[row], row, live)
        for i in range(m):
            out[row, i] = live[n + i]
        for i in range(out.shape[1] - m):
            out[row, m + i] = live[2 * n + m + i]
