"""A Kalman smoother of constant gains, compiled: forwards, then backwards (Rauch, Tung and Striebel 1965)."""

import numpy as np
from numba import njit, types

from equalizer.signals.signal import FloatArray

_MATRIX = types.float64[:, ::1]
_READ = types.Array(types.float64, 2, "C", readonly=True)


@njit(types.void(_MATRIX, _MATRIX, _MATRIX, _MATRIX, _READ, _READ, _MATRIX), cache=True, nogil=True)
def smooth(  # noqa: C901, PLR0913 - a kernel takes flat arrays and writes its products out
    advance: FloatArray,
    look: FloatArray,
    gain: FloatArray,
    back: FloatArray,
    pushed: FloatArray,
    seen: FloatArray,
    out: FloatArray,
) -> None:
    """out (n, s): the states. advance (s, s), look (c, s), gain (s, c), back (s, s): see `motion_smoother`. pushed
    (n, s): what is added over the step that begins there. seen (n, c): NaN where nothing was."""
    n, s, c = out.shape[0], out.shape[1], look.shape[0]
    foreseen = np.empty((n, s))
    state = out[0].copy()
    for k in range(n):
        foreseen[k] = state
        known = True
        for i in range(c):
            known = known and not np.isnan(seen[k, i])
        if known:
            off = np.empty(c)
            for i in range(c):
                total = seen[k, i]
                for j in range(s):
                    total -= look[i, j] * foreseen[k, j]
                off[i] = total
            for j in range(s):
                for i in range(c):
                    state[j] += gain[j, i] * off[i]
        out[k] = state
        for j in range(s):
            total = pushed[k, j]
            for i in range(s):
                total += advance[j, i] * out[k, i]
            state[j] = total
    for k in range(n - 2, -1, -1):
        for j in range(s):
            total = 0.0
            for i in range(s):
                total += back[j, i] * (out[k + 1, i] - foreseen[k + 1, i])
            state[j] = out[k, j] + total
        out[k] = state
