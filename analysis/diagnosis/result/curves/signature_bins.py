"""Compute bin means of a signal over a variable, with standard errors that allow for correlated samples.

Samples of one bin within a block of `_BLOCK_S` count as one observation: with the means y_b of w_b samples per block,
and the bin's mean y, the standard error is sqrt(sum of w_b² (y_b - y)²) / sum of w_b.
"""

import numpy as np
import numpy.typing as npt

from analysis.diagnosis.types import Mask
from equalizer.signals.signal import FloatArray

_BIN_COUNT, _LAW_BIN_COUNT = 30, 120
"""Number of bins of a measured signal, and of a drawn law, which has no noise. Chosen, like all constants here."""
_BLOCK_S = 0.5
"""Length of the blocks (s) that count as independent."""
_MIN_BIN_SAMPLES = 20
"""Least number of samples in a bin; bins with fewer are left out."""
_REST_SHARE = 0.01
"""Largest distance from the median, as a share of the range, that counts as rest when bin edges are chosen."""


def compute_bin_means(
    abscissa: FloatArray, values: FloatArray, used: Mask, rate_hz: float
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Compute mean abscissa, mean value and its standard error per bin, (bins,) each; bins by `_compute_edges`.
    abscissa, values: (n,), finite where used; used: (n,), with at least one sample; rate_hz: of the samples, Hz."""
    block_numbers = (np.flatnonzero(used) / (_BLOCK_S * rate_hz)).astype(int)
    used_abscissa, used_values = abscissa[used], values[used]
    bin_index = np.digitize(used_abscissa, _compute_edges(used_abscissa, _BIN_COUNT)[1:-1])
    rows = []
    for bin_number in range(bin_index.max(initial=0) + 1):
        is_in_bin = bin_index == bin_number
        if is_in_bin.sum() >= _MIN_BIN_SAMPLES:
            rows.append(
                (
                    float(used_abscissa[is_in_bin].mean()),
                    *_compute_block_mean(used_values[is_in_bin], block_numbers[is_in_bin]),
                )
            )
    table = np.array(rows).reshape(-1, 3)
    return table[:, 0], table[:, 1], table[:, 2]


def compute_law_bin_means(abscissa: FloatArray, values: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Compute mean abscissa and mean value of a law over finer bins, (bins,) each; bins with fewer than three samples
    are left out. abscissa, values: (n,), of which samples that are not finite (a diverged simulation) are left out."""
    is_finite = np.isfinite(abscissa) & np.isfinite(values)
    abscissa, values = abscissa[is_finite], values[is_finite]
    if not len(abscissa):
        return abscissa, values
    bin_index = np.digitize(abscissa, _compute_edges(abscissa, _LAW_BIN_COUNT)[1:-1])
    sample_counts = np.bincount(bin_index)
    is_filled = sample_counts >= 3
    means = [
        np.bincount(bin_index, weights=weights)[is_filled] / sample_counts[is_filled] for weights in (abscissa, values)
    ]
    return means[0], means[1]


def compute_correlation_ratio(abscissa: FloatArray, values: FloatArray) -> float:
    """Compute the correlation ratio (eta squared): share of the values' variance explained by their mean per bin of the
    abscissa. abscissa, values: (n,), n >= 1, finite."""
    bin_index = np.digitize(abscissa, _compute_edges(abscissa, _BIN_COUNT)[1:-1])
    sample_counts = np.maximum(np.bincount(bin_index), 1)
    means = np.bincount(bin_index, weights=values) / sample_counts
    return float(np.var(means[bin_index]) / max(float(np.var(values)), 1e-300))


def compute_running_rms(
    time_s: FloatArray, values: FloatArray, used: Mask
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Compute mean time (s), rms and its standard error for independent samples, (stretches,) each, in `_BIN_COUNT` or
    fewer stretches with equal numbers (within one) of used samples. time_s, values, used: (n,)."""
    stretches = [stretch for stretch in np.array_split(np.flatnonzero(used), _BIN_COUNT) if len(stretch)]
    rms = np.array([float(np.sqrt(np.mean(values[stretch] ** 2))) for stretch in stretches])
    square_errors = np.array([float(np.std(values[stretch] ** 2) / np.sqrt(len(stretch))) for stretch in stretches])
    return (
        np.array([float(time_s[stretch].mean()) for stretch in stretches]),
        rms,
        square_errors / np.maximum(2 * rms, 1e-300),
    )


def _compute_edges(abscissa: FloatArray, bin_count: int) -> FloatArray:
    """Compute the edges of fewer than bin_count bins, rising: half at quantiles (of the samples that are not at rest),
    half at equal widths between the 0.1 % and 99.9 % quantiles, so that both the middle and the ends are covered.
    Callers add values beyond the ends to the outer bins. abscissa: (n,), n >= 1."""
    low_quantile, high_quantile = np.quantile(abscissa, [0.001, 0.999])
    # A channel that rests most of the time would have all its bins at rest.
    moving_samples = abscissa[np.abs(abscissa - np.median(abscissa)) > _REST_SHARE * (high_quantile - low_quantile)]
    quantile_edges = np.quantile(moving_samples if len(moving_samples) else abscissa, np.linspace(0, 1, bin_count // 2))
    return np.unique(np.concatenate([quantile_edges, np.linspace(low_quantile, high_quantile, bin_count // 2)]))


def _compute_block_mean(values: FloatArray, blocks: npt.NDArray[np.int_]) -> tuple[float, float]:
    """Compute the mean and its standard error by the formula of the module; for a single block, the standard deviation
    of values. values, blocks: (n,), n >= 1; blocks: number of each sample's block."""
    _, block_index = np.unique(blocks, return_inverse=True)
    block_weights = np.bincount(block_index).astype(float)
    block_means = np.bincount(block_index, weights=values) / block_weights
    mean = float(values.mean())
    if len(block_means) < 2:
        return mean, float(values.std())
    return mean, float(np.sqrt(np.sum((block_weights * (block_means - mean)) ** 2)) / block_weights.sum())
