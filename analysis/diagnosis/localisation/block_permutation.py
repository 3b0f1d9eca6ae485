"""Block permutation test: whether a statistic of autocorrelated series is larger than under the null hypothesis.

A permutation of single samples would treat correlated neighbours as independent. Blocks of three correlation times are
permuted instead, which preserves the correlation within a block. The p-value is the share of permutations whose
statistic is at least the observed one. A p-value below about ten over the number of permutations cannot be counted
precisely: there the upper tail of a gamma distribution with the mean m and variance v of the permuted statistics is
used,

    P(T >= t) = Q(m²/v, t m/v),      Q the regularised upper incomplete gamma function.

References: Winkler, Ridgway, Douaud, Nichols and Smith, NeuroImage 141 (2016) 502 (gamma tail); Bartlett, J. Royal
Stat. Soc. 98 (1935) 536 (correlation time).
"""

from collections.abc import Callable
from itertools import pairwise

import numpy as np
import numpy.typing as npt
from scipy.special import gammaincc

from equalizer.signals.signal import FloatArray

IntArray = npt.NDArray[np.int64]
_CORRELATION_TIMES_PER_BLOCK = 3.0
"""Length of a block, in correlation times. Chosen."""
_MIN_EXCEEDING_PERMUTATIONS = 10
"""Number of permutations, the observed order included, with a statistic at least the observed one, above which the
p-value is counted instead of fitted. Chosen."""
LEAST_P_VALUE = 1e-6
"""Lower limit of a fitted p-value, because the gamma distribution is not reliable further out. Chosen."""
_MIN_BLOCKS_PER_STRATUM = 8
"""Least number of blocks per stratum; blocks are shortened to it, to one sample at the least. Chosen."""


def compute_correlation_time(series: FloatArray) -> float:
    """Compute the correlation time of a series (n,), n >= 1, in samples: 1 + 2 sum over 1 <= k < n / 4 of r_k², with
    r_k the autocorrelation at lag k, divided by the factor that it has for white noise. The variance of the correlation
    of two independent series with this autocorrelation is larger by this factor (Bartlett). 1 for a constant series."""
    n = len(series)
    centred = series - series.mean()
    spectrum = np.abs(np.fft.rfft(centred, 2 * n)) ** 2
    lags = max(n // 4, 1)
    covariance = np.fft.irfft(spectrum)[:lags]
    if covariance[0] <= 0:
        return 1.0
    # Chance correlations add 1 / n at each lag on average; the divisor corrects for it.
    return float((2 * np.sum((covariance / covariance[0]) ** 2) - 1) / (1 + 2 * lags / n))


def shuffle_blocks(strata: IntArray, requested_block_samples: int, random: np.random.Generator) -> IntArray:
    """Shuffle blocks within each stratum; returns indices (n,). A stratum is cut into blocks from a random sample on,
    as a ring; the remainder that fills no block comes last. strata: (n,), n >= 1, label of each sample's stratum: a
    stratum is a run of equal labels. requested_block_samples: length of a block, shortened in a short stratum."""
    indices, shuffled_indices = np.arange(len(strata)), np.empty(len(strata), dtype=np.int64)
    edges = np.concatenate([[0], np.flatnonzero(np.diff(strata)) + 1, [len(strata)]])
    for start, stop in pairwise(edges.tolist()):
        stratum_samples = stop - start
        block_samples = max(1, min(requested_block_samples, stratum_samples // _MIN_BLOCKS_PER_STRATUM))
        ring_start = stop - int(random.integers(stratum_samples))
        rotated = np.concatenate([indices[ring_start:stop], indices[start:ring_start]])
        block_count = stratum_samples // block_samples
        shuffled_samples = block_count * block_samples
        shuffled_indices[start : start + shuffled_samples].reshape(block_count, block_samples)[:] = rotated[
            :shuffled_samples
        ].reshape(block_count, block_samples)[random.permutation(block_count)]
        shuffled_indices[start + shuffled_samples : stop] = rotated[shuffled_samples:]
    return shuffled_indices


def compute_block_length(series: FloatArray) -> int:
    """Compute the length of a block in samples: three correlation times of the series (n,), n >= 1, at least 1."""
    return max(1, round(_CORRELATION_TIMES_PER_BLOCK * compute_correlation_time(series)))


def compute_permutation_p_values(
    compute_statistics: Callable[[IntArray], FloatArray],
    strata: IntArray,
    block_samples: int,
    permutation_count: int,
    random: np.random.Generator,
) -> FloatArray:
    """Compute the p-values (tests,) of the observed statistics, counted or from the fitted gamma tail (see the module).
    compute_statistics: from indices (n,) to statistics (tests,), not negative, larger where the null hypothesis is less
    likely. strata, block_samples: as for `shuffle_blocks`. permutation_count: at least 2, for the variance."""
    observed = compute_statistics(np.arange(len(strata)))
    permuted = np.array(
        [compute_statistics(shuffle_blocks(strata, block_samples, random)) for _ in range(permutation_count)]
    )
    mean, variance = permuted.mean(axis=0), np.maximum(permuted.var(axis=0, ddof=1), np.finfo(np.float64).tiny)
    tail_p_values = gammaincc(mean**2 / variance, observed * mean / variance)
    counted_p_values = (np.sum(permuted >= observed, axis=0) + 1) / (permutation_count + 1)
    combined_p_values = np.where(
        counted_p_values > _MIN_EXCEEDING_PERMUTATIONS / (permutation_count + 1),
        counted_p_values,
        np.maximum(tail_p_values, LEAST_P_VALUE),
    )
    return np.asarray(combined_p_values, dtype=np.float64)
