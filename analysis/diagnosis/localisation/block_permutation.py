"""Block permutation test: whether a statistic of correlated series exceeds what chance gives.

Exchanging single samples would count neighbouring, correlated samples as independent. Blocks of three correlation times
are exchanged instead, which leaves the correlation within a block as it is. The p-value is the share of permutations
whose statistic is at least the observed one. A p-value below some ten over the number of permutations cannot be
counted: there the upper tail of a gamma distribution with the mean m and variance v of the permuted statistics is used,

    P(T >= t) = Q(m²/v, t m/v),      Q the regularised upper incomplete gamma function.

References: Winkler, Ridgway, Douaud, Nichols and Smith, NeuroImage 141 (2016) 502 (gamma tail); Bartlett, J. Royal
Stat. Soc. 98 (1935) 536 (correlation time). Called by `state_dependence` and `state_regions`.
"""

from collections.abc import Callable
from itertools import pairwise

import numpy as np
import numpy.typing as npt
from scipy.special import gammaincc

from equalizer.signals.signal import FloatArray

IntArray = npt.NDArray[np.int64]
_CORRELATION_TIMES_PER_BLOCK = 3.0
"""Length of a block, in correlation times. By hand."""
_LEAST_EXCEEDING = 10
"""Number of permutations with a larger statistic above which the p-value is counted instead of fitted. By hand."""
LEAST_P_VALUE = 1e-6
"""Least p-value: the fitted tail is not trusted below it. By hand."""
_LEAST_BLOCKS = 8
"""Least number of blocks per stratum; in a short stratum blocks are shorter for it. By hand."""


def compute_correlation_time(series: FloatArray) -> float:
    """Correlation time of a series (n,) in samples, at least about 1: 1 + 2 sum over k >= 1 of r_k², r_k the
    autocorrelation at lag k up to n / 4. By this factor the correlation inflates the variance of a product's mean of
    two such series (Bartlett). 1 for a constant series."""
    n = len(series)
    centred = series - series.mean()
    spectrum = np.abs(np.fft.rfft(centred, 2 * n)) ** 2
    lags = max(n // 4, 1)
    covariance = np.fft.irfft(spectrum)[:lags]
    if covariance[0] <= 0:
        return 1.0
    # Chance correlations add 1 / n at each lag on average; the divisor corrects for it.
    return float((2 * np.sum((covariance / covariance[0]) ** 2) - 1) / (1 + 2 * lags / n))


def shuffle_blocks(strata: IntArray, requested_samples: int, random: np.random.Generator) -> IntArray:
    """Indices (n,) of a random exchange of blocks within each stratum. Blocks are cut from a random offset on, the
    stratum taken as a ring; the remainder that fills no block stays at its end. strata: (n,), label of each sample's
    stratum, contiguous. requested_samples: length in samples."""
    indices, order = np.arange(len(strata)), np.empty(len(strata), dtype=np.int64)
    edges = np.concatenate([[0], np.flatnonzero(np.diff(strata)) + 1, [len(strata)]])
    for start, stop in pairwise(edges.tolist()):
        stratum_samples = stop - start
        block_samples = max(1, min(requested_samples, stratum_samples // _LEAST_BLOCKS))
        offset = stop - int(random.integers(stratum_samples))
        rotated = np.concatenate([indices[offset:stop], indices[start:offset]])
        block_count = stratum_samples // block_samples
        shuffled_samples = block_count * block_samples
        order[start : start + shuffled_samples].reshape(block_count, block_samples)[:] = rotated[
            :shuffled_samples
        ].reshape(block_count, block_samples)[random.permutation(block_count)]
        order[start + shuffled_samples : stop] = rotated[shuffled_samples:]
    return order


def compute_block_length(series: FloatArray) -> int:
    """Length of a block in samples: three correlation times of the series (n,), at least 1."""
    return max(1, round(_CORRELATION_TIMES_PER_BLOCK * compute_correlation_time(series)))


def compute_permutation_p_values(
    compute_statistics: Callable[[IntArray], FloatArray],
    strata: IntArray,
    block_samples: int,
    permutation_count: int,
    random: np.random.Generator,
) -> FloatArray:
    """p-values (tests,) of the observed statistics, counted or from the fitted gamma tail (see the module).
    compute_statistics: from indices (n,) to statistics (tests,), not negative, larger where the null hypothesis is less
    likely. strata, block_samples: as of `shuffle_blocks`."""
    observed = compute_statistics(np.arange(len(strata)))
    permuted = np.array(
        [compute_statistics(shuffle_blocks(strata, block_samples, random)) for _ in range(permutation_count)]
    )
    mean, variance = permuted.mean(axis=0), np.maximum(permuted.var(axis=0, ddof=1), np.finfo(np.float64).tiny)
    tail_p_values = gammaincc(mean**2 / variance, observed * mean / variance)
    # Where enough permutations had a larger statistic, their share is used instead of the fitted tail.
    counted_p_values = (np.sum(permuted >= observed, axis=0) + 1) / (permutation_count + 1)
    combined_p_values = np.where(
        counted_p_values > _LEAST_EXCEEDING / (permutation_count + 1),
        counted_p_values,
        np.maximum(tail_p_values, LEAST_P_VALUE),
    )
    return np.asarray(combined_p_values, dtype=np.float64)
