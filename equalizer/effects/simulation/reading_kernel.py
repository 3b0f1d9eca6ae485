"""Sampling faults of a logger, compiled: a wrong clock, and lost samples that repeat the one before.

A wrong clock: sample k is the response at time t = k per_sample + offset (in samples), interpolated by a tabulated
windowed sinc (see `interpolated_response`) or linearly. Lost samples: in a simulation they are given; where a
measurement exists, each is decided by a likelihood ratio: with white noise of standard deviation s per channel, sample
k is taken as lost where

    sum over channels of ((y - x_k)² - (y - x_before)²) / s²  >  2 ln(odds against a loss),

y the measurement, x_k the simulated sample, x_before the last one that was not lost.
"""

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
def resample_at(
    samples: FloatArray,
    per_sample: float,
    offset: float,
    filter_table: FloatArray,
    linear_share: float,
    out: FloatArray,
) -> None:
    """out[k] = samples at the time k per_sample + offset, in samples; the first and the last are held beyond the ends.

    samples, out: (n, p). filter_table: (phases + 1, taps), weights of the interpolation filter at fractions 0 to 1 of a
    sample, themselves interpolated linearly. linear_share: share, 0 to 1, of linear interpolation."""
    n, p = samples.shape
    phases, taps = filter_table.shape[0] - 1, filter_table.shape[1]
    weights = np.empty(taps)
    for k in range(n):
        position = min(max(k * per_sample + offset, 0.0), n - 1.0)
        sample = min(int(position), n - 2)
        fraction = position - sample
        row = min(int(fraction * phases), phases - 1)
        row_fraction = fraction * phases - row
        for tap in range(taps):
            weights[tap] = (1 - linear_share) * (
                (1 - row_fraction) * filter_table[row, tap] + row_fraction * filter_table[row + 1, tap]
            )
        weights[taps // 2 - 1] += linear_share * (1 - fraction)
        weights[taps // 2] += linear_share * fraction
        first = sample - taps // 2 + 1
        for c in range(p):
            total = 0.0
            for tap in range(taps):
                total += weights[tap] * samples[min(max(first + tap, 0), n - 1), c]
            out[k, c] = total


@njit(types.void(_IN, _FLAGS, _MATRIX), cache=True, nogil=True)
def repeat_where(samples: FloatArray, lost: Flags, out: FloatArray) -> None:
    """Replace each lost sample by the last one that was not lost. samples, out: (n, p); lost: (n,). The first sample is
    never lost."""
    out[0] = samples[0]
    for k in range(1, samples.shape[0]):
        out[k] = out[k - 1] if lost[k] else samples[k]


@njit(types.void(_IN, _IN, _VECTOR_IN, types.float64, _MATRIX, _FLAGS), cache=True, nogil=True)
def repeat_as_measured(
    samples: FloatArray, measured: FloatArray, noise: FloatArray, log_odds_against: float, out: FloatArray, lost: Flags
) -> None:
    """Fill out (n, p) and lost (n,): a sample counts as lost where the measurement makes that likelier (see the
    module).

    samples, measured: (n, p), simulated and measured. noise: (p,), standard deviation in the channels' units.
    log_odds_against: 2 ln of the odds that a sample is not lost."""
    n, p = samples.shape
    out[0] = samples[0]
    for k in range(1, n):
        likelihood_gain = 0.0
        for c in range(p):
            kept_error, repeated_error = measured[k, c] - samples[k, c], measured[k, c] - out[k - 1, c]
            likelihood_gain += (kept_error * kept_error - repeated_error * repeated_error) / (noise[c] * noise[c])
        lost[k] = likelihood_gain > log_odds_against
        out[k] = out[k - 1] if lost[k] else samples[k]
