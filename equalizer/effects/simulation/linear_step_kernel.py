"""Compiled time steps x[k+1] = A x[k] + b[k] of a linear mechanism: one step, and a loop without further forces.

x is the state (s,), b the contribution of the commands over the step. A is either a full matrix (transposed) or 2 x 2
blocks, which need O(s) instead of O(s²) operations; `modal_form` chooses. Called by `mechanism_kernel`, `stepping`.
"""

import numpy as np
from numba import njit, types

from equalizer.signals.signal import FloatArray

FAST_MATH_FLAGS = {"reassoc", "contract"}
"""LLVM flags: sums may be reordered and products fused, for vectorised loops; NaN and infinity are kept."""
_VECTOR = types.float64[::1]
_MATRIX = types.float64[:, ::1]
"""numba types of contiguous arrays that a kernel may write to."""


@njit(types.void(_MATRIX, _VECTOR, _VECTOR), cache=True, nogil=True, fastmath=FAST_MATH_FLAGS)
def _advance_with_full_matrix(step_matrix: FloatArray, contribution: FloatArray, state: FloatArray) -> None:
    """Advance the state (s,) by one step with a full matrix, in place. step_matrix: (s, s), A transposed. contribution:
    (s or more,), of which the first s are used."""
    start_state = state.copy()
    state[:] = contribution[: state.shape[0]]
    for j in range(state.shape[0]):
        for i in range(state.shape[0]):
            state[i] += step_matrix[j, i] * start_state[j]


@njit(inline="always")
def advance_state(step_matrix: FloatArray, contribution: FloatArray, state: FloatArray) -> None:
    """Advance the state (s,) by one step, in place. step_matrix: (4, s / 2) or (s, s), see `modal_form.StepForm`.
    contribution: (s or more,), of the commands; only the first s numbers are used."""
    half = state.shape[0] // 2
    if step_matrix.shape[1] != half:
        _advance_with_full_matrix(step_matrix, contribution, state)
        return
    for i in range(half):
        first, second = state[i], state[half + i]
        state[i] = step_matrix[0, i] * first + step_matrix[1, i] * second + contribution[i]
        state[half + i] = step_matrix[2, i] * first + step_matrix[3, i] * second + contribution[half + i]


@njit(types.void(_MATRIX, _MATRIX, _VECTOR), cache=True, nogil=True, fastmath=FAST_MATH_FLAGS)
def advance_unforced(step_matrix: FloatArray, contributions: FloatArray, state: FloatArray) -> None:
    """Simulate n steps under the commands alone. contributions: (n, s or more), of the commands over each step;
    overwritten by the state before each step. state: (s,), overwritten by the state at the end."""
    size = state.shape[0]
    contribution = np.empty(size)
    for k in range(contributions.shape[0]):
        for i in range(size):
            contribution[i] = contributions[k, i]
            contributions[k, i] = state[i]
        advance_state(step_matrix, contribution, state)
