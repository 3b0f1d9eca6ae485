"""The two passes of a tracker with stored gains, compiled: costate backward, model forward."""

import numpy as np
from numba import njit, types

from equalizer.signals.signal import FloatArray

_VECTOR = types.Array(types.float64, 1, "C", readonly=True)
_MATRIX = types.Array(types.float64, 2, "C", readonly=True)
_STACK = types.Array(types.float64, 3, "C", readonly=True)
_OUT = types.float64[:, ::1]


@njit(types.void(_MATRIX, _MATRIX, _STACK, _STACK, types.float64[::1], _OUT), cache=True, nogil=True)
def feedforward(
    joined: FloatArray, pulled: FloatArray, K: FloatArray, H_inverse: FloatArray, v: FloatArray, g: FloatArray
) -> None:
    """Fills g (N, m), the part of the forces that the trajectory ahead decides. v: (n,), the costate at the end, which
    becomes that of the start. joined: [A B]; pulled: wanted @ (Q [C D]), (N, n + m)."""
    n, m = joined.shape[0], g.shape[1]
    s = np.empty(n + m)
    for k in range(g.shape[0] - 1, -1, -1):
        s[:] = pulled[k]
        for i in range(n):
            for c in range(n + m):
                s[c] += joined[i, c] * v[i]
        v[:] = s[:n]
        for i in range(m):
            g[k, i] = 0.0
            for j in range(m):
                g[k, i] += H_inverse[k, i, j] * s[n + j]
            for c in range(n):
                v[c] -= K[k, i, c] * s[n + i]


@njit(types.void(_MATRIX, _STACK, _MATRIX, types.float64[::1], _OUT, _OUT), cache=True, nogil=True)
def simulate(
    step: FloatArray, K: FloatArray, g: FloatArray, x: FloatArray, forces: FloatArray, predicted: FloatArray
) -> None:
    """Fills forces (N, m), u = g - K x, and predicted (N, p). x: (n,), the state at the start, which becomes that of
    the end. step: [A B; C D]', (n + m, n + p)."""
    m, n = K.shape[1], K.shape[2]
    width = step.shape[1]
    s = np.empty(width)
    for k in range(g.shape[0]):
        for i in range(m):
            value = g[k, i]
            for c in range(n):
                value -= K[k, i, c] * x[c]
            forces[k, i] = value
        s[:] = 0.0
        for j in range(n):
            for c in range(width):
                s[c] += step[j, c] * x[j]
        for j in range(m):
            for c in range(width):
                s[c] += step[n + j, c] * forces[k, j]
        for c in range(n):
            x[c] = s[c]
        for c in range(width - n):
            predicted[k, c] = s[n + c]
