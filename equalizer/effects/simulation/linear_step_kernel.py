"""Compiled steps x[k+1] = A x[k] + b[k] of a linear structure: a single step, and a loop without further forces.

x is the state (s,), b the contribution of the commands. A is either a full matrix (transposed) or consists of 2 x 2
blocks, which cost O(s) instead of O(s²) per step; `modal_form` chooses.
"""

import numpy as np
from numba import njit, types

from equalizer.signals.signal import FloatArray

FAST = {"reassoc", "contract"}
"""LLVM flags: sums may be reordered and products fused (vectorised loops); NaN and infinity keep their meaning."""
_VECTOR = types.float64[::1]
_MATRIX = types.float64[:, ::1]


@njit(types.void(_MATRIX, _VECTOR, _VECTOR), cache=True, nogil=True, fastmath=FAST)
def _advance_dense(advance: FloatArray, contribution: FloatArray, state: FloatArray) -> None:
    """One step with a full matrix, in place. advance: (s, s), transposed; contribution: (s, ...); state: (s,)."""
    start_state = state.copy()
    state[:] = contribution[: state.shape[0]]
    for j in range(state.shape[0]):
        for i in range(state.shape[0]):
            state[i] += advance[j, i] * start_state[j]


@njit(inline="always")
def advance_state(advance: FloatArray, contribution: FloatArray, state: FloatArray) -> None:
    """One step of the state (s,), in place. advance: (4, s / 2) or (s, s), see `modal_form.StepForm`. contribution:
    (s, ...), of the commands; only its first s numbers are used."""
    half = state.shape[0] // 2
    if advance.shape[1] != half:
        _advance_dense(advance, contribution, state)
        return
    for i in range(half):
        first, second = state[i], state[half + i]
        state[i] = advance[0, i] * first + advance[1, i] * second + contribution[i]
        state[half + i] = advance[2, i] * first + advance[3, i] * second + contribution[half + i]


@njit(types.void(_MATRIX, _MATRIX, _VECTOR), cache=True, nogil=True, fastmath=FAST)
def advance_unforced(advance: FloatArray, rows: FloatArray, state: FloatArray) -> None:
    """Motion under the commands alone. rows: (n, s ...), contribution of the commands over each step; overwritten by
    the state before each step. state: (s,), overwritten by the state at the end."""
    size = state.shape[0]
    contribution = np.empty(size)
    for k in range(rows.shape[0]):
        for i in range(size):
            contribution[i] = rows[k, i]
            rows[k, i] = state[i]
        advance_state(advance, contribution, state)
