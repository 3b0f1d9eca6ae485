"""Reading of a sampled response with a wrong clock or with lost samples, compiled."""

import numpy as np
import numpy.typing as npt
from numba import njit, types

from equalizer.signals.signal import FloatArray

_MATRIX = types.float64[:, ::1]
_IN = types.Array(types.float64, 2, "C", readonly=True)
_VECTOR_IN = types.Array(types.float64, 1, "C", readonly=True)
_FLAGS = types.boolean[::1]

Flags = npt.NDArray[np.bool_]


@njit(types.void(_IN, types.float64, types.float64, _IN, types.float64, _MATRIX), cache=True, nogil=True)
def read_at(
    samples: FloatArray, per_sample: float, offset: float, between: FloatArray, straight: float, out: FloatArray
) -> None:
    """out[k] = samples at k per_sample + offset; held beyond both ends. samples, out: (n, p). between: (phases + 1,
    taps), interpolation weights. straight: share of linear interpolation."""
    n, p = samples.shape
    phases, taps = between.shape[0] - 1, between.shape[1]
    weights = np.empty(taps)
    for k in range(n):
        at = min(max(k * per_sample + offset, 0.0), n - 1.0)
        whole = min(int(at), n - 2)
        part = at - whole
        row = min(int(part * phases), phases - 1)
        along = part * phases - row
        for tap in range(taps):
            weights[tap] = (1 - straight) * ((1 - along) * between[row, tap] + along * between[row + 1, tap])
        weights[taps // 2 - 1] += straight * (1 - part)
        weights[taps // 2] += straight * part
        first = whole - taps // 2 + 1
        for c in range(p):
            total = 0.0
            for tap in range(taps):
                total += weights[tap] * samples[min(max(first + tap, 0), n - 1), c]
            out[k, c] = total


@njit(types.void(_IN, _FLAGS, _MATRIX), cache=True, nogil=True)
def repeat_where(samples: FloatArray, lost: Flags, out: FloatArray) -> None:
    """Replace each lost sample by the one that was read before it. samples, out: (n, p), lost: (n,)"""
    out[0] = samples[0]
    for k in range(1, samples.shape[0]):
        out[k] = out[k - 1] if lost[k] else samples[k]


@njit(types.void(_IN, _IN, _VECTOR_IN, types.float64, _MATRIX, _FLAGS), cache=True, nogil=True)
def repeat_as_measured(
    samples: FloatArray, measured: FloatArray, noise: FloatArray, odds_against: float, out: FloatArray, lost: Flags
) -> None:
    """Fill out (n, p) and lost (n,): a sample counts as lost where the measurement makes that likelier.
    odds_against: 2 ln of the odds that a sample is not lost."""
    n, p = samples.shape
    out[0] = samples[0]
    for k in range(1, n):
        better = 0.0
        for c in range(p):
            fresh, old = measured[k, c] - samples[k, c], measured[k, c] - out[k - 1, c]
            better += (fresh * fresh - old * old) / (noise[c] * noise[c])
        lost[k] = better > odds_against
        out[k] = out[k - 1] if lost[k] else samples[k]
