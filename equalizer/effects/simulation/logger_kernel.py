"""Compiled sampling faults of a data logger: a wrong clock, and lost samples that repeat the preceding one.

Wrong clock: the response at shifted or scaled times, interpolated by a tabulated windowed sinc
(`interpolated_response`), linearly, or by a mixture. Lost samples: given by a mask, or decided by a likelihood-ratio
test against a measurement. With white noise of standard deviation s per channel, sample k is lost where

    sum over channels of ((y - x_k)² - (y - x_before)²) / s²  >  2 ln(odds against a loss),

where y is the measurement, x_k the simulated sample, and x_before the last sample that was not lost. Called by
`interpolated_response` and the effect `lost_samples`.
"""

import numpy as np
from numba import njit, types

from equalizer.signals.signal import BoolArray, FloatArray

_OUTPUT_MATRIX = types.float64[:, ::1]
_INPUT_MATRIX = types.Array(types.float64, 2, "C", readonly=True)
_INPUT_VECTOR = types.Array(types.float64, 1, "C", readonly=True)
_OUTPUT_MASK = types.boolean[::1]
"""Types of the kernels' arguments: inputs are read only."""


@njit(
    types.void(_INPUT_MATRIX, types.float64, types.float64, _INPUT_MATRIX, types.float64, _OUTPUT_MATRIX),
    cache=True,
    nogil=True,
)
def interpolate_samples(
    samples: FloatArray,
    step_samples: float,
    offset_samples: float,
    filter_table: FloatArray,
    linear_share: float,
    resampled: FloatArray,
) -> None:
    """Fill resampled[k] with the samples at the time k step_samples + offset_samples, in samples; the first and the
    last are held beyond the ends.

    samples, resampled: (n, p), n >= 2. filter_table: (phases + 1, taps), weights of the interpolation filter at
    fractions 0 to 1 of a sample, themselves interpolated linearly. linear_share: share, 0 to 1, of linear
    interpolation."""
    sample_count, channel_count = samples.shape
    phases, taps = filter_table.shape[0] - 1, filter_table.shape[1]
    weights = np.empty(taps)
    for k in range(sample_count):
        position = min(max(k * step_samples + offset_samples, 0.0), sample_count - 1.0)
        previous_sample = min(int(position), sample_count - 2)
        fraction = position - previous_sample
        row = min(int(fraction * phases), phases - 1)
        row_fraction = fraction * phases - row
        for tap in range(taps):
            weights[tap] = (1 - linear_share) * (
                (1 - row_fraction) * filter_table[row, tap] + row_fraction * filter_table[row + 1, tap]
            )
        weights[taps // 2 - 1] += linear_share * (1 - fraction)
        weights[taps // 2] += linear_share * fraction
        first = previous_sample - taps // 2 + 1
        for c in range(channel_count):
            total = 0.0
            for tap in range(taps):
                total += weights[tap] * samples[min(max(first + tap, 0), sample_count - 1), c]
            resampled[k, c] = total


@njit(types.void(_INPUT_MATRIX, _OUTPUT_MASK, _OUTPUT_MATRIX), cache=True, nogil=True)
def repeat_lost_samples(samples: FloatArray, lost: BoolArray, repeated: FloatArray) -> None:
    """Fill repeated (n, p) with the samples (n, p), each lost one replaced by the last that was not lost. lost: (n,);
    its first element is ignored."""
    repeated[0] = samples[0]
    for k in range(1, samples.shape[0]):
        repeated[k] = repeated[k - 1] if lost[k] else samples[k]


@njit(
    types.void(_INPUT_MATRIX, _INPUT_MATRIX, _INPUT_VECTOR, types.float64, _OUTPUT_MATRIX, _OUTPUT_MASK),
    cache=True,
    nogil=True,
)
def repeat_likely_losses(
    samples: FloatArray,
    measured: FloatArray,
    noise: FloatArray,
    threshold: float,
    repeated: FloatArray,
    lost: BoolArray,
) -> None:
    """Decide by the likelihood-ratio test of the module which samples are lost: fill lost (n,), except for its first
    element, and repeated (n, p), as `repeat_lost_samples` does.

    samples, measured: (n, p), simulated and measured. noise: (p,), standard deviation in the channels' units.
    threshold: 2 ln of the prior odds that a sample is not lost."""
    sample_count, channel_count = samples.shape
    repeated[0] = samples[0]
    for k in range(1, sample_count):
        log_likelihood_gain = 0.0
        for c in range(channel_count):
            error_if_kept, error_if_lost = measured[k, c] - samples[k, c], measured[k, c] - repeated[k - 1, c]
            log_likelihood_gain += (error_if_kept * error_if_kept - error_if_lost * error_if_lost) / (
                noise[c] * noise[c]
            )
        lost[k] = log_likelihood_gain > threshold
        repeated[k] = repeated[k - 1] if lost[k] else samples[k]
