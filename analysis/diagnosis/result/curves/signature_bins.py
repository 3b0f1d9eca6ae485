"""Bin means of a signal over a variable, with standard errors that allow for correlated samples.

Samples of one bin within a block of `_BLOCK_S` count as one observation: with the means y_b of w_b samples per block,
and the bin's mean y, the standard error is sqrt(sum of w_b² (y_b - y)²) / sum of w_b. Called by `signature_curves`,
`law_curves` and `state_maps`.
"""

import numpy as np
import numpy.typing as npt

from analysis.diagnosis.types import Mask
from equalizer.signals.signal import FloatArray

_BINS, _LAW_BINS = 30, 120
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
    """Mean abscissa, mean value and its standard error per bin, (bins,) each; bins by `_compute_edges`. abscissa,
    values, used: (n,)."""
    blocks = (np.flatnonzero(used) / (_BLOCK_S * rate_hz)).astype(int)
    x, y = abscissa[used], values[used]
    bin_index = np.digitize(x, _compute_edges(x, _BINS)[1:-1])
    rows = []
    for k in range(bin_index.max(initial=0) + 1):
        in_bin = bin_index == k
        if in_bin.sum() >= _MIN_BIN_SAMPLES:
            rows.append((float(x[in_bin].mean()), *_compute_block_mean(y[in_bin], blocks[in_bin])))
    table = np.array(rows).reshape(-1, 3)
    return table[:, 0], table[:, 1], table[:, 2]


def compute_law_bin_means(abscissa: FloatArray, values: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Mean abscissa and mean value of a law over finer bins, (bins,) each; bins with fewer than three samples are left
    out. abscissa, values: (n,), of which samples that are not finite (a diverged simulation) are left out."""
    is_finite = np.isfinite(abscissa) & np.isfinite(values)
    abscissa, values = abscissa[is_finite], values[is_finite]
    if not len(abscissa):
        return abscissa, values
    bin_index = np.digitize(abscissa, _compute_edges(abscissa, _LAW_BINS)[1:-1])
    count = np.bincount(bin_index)
    is_filled = count >= 3
    means = [np.bincount(bin_index, weights=weights)[is_filled] / count[is_filled] for weights in (abscissa, values)]
    return means[0], means[1]


def compute_correlation_ratio(abscissa: FloatArray, values: FloatArray) -> float:
    """Correlation ratio (eta squared): share of the values' variance explained by their mean per bin of the abscissa.
    abscissa, values: (n,), finite."""
    bin_index = np.digitize(abscissa, _compute_edges(abscissa, _BINS)[1:-1])
    count = np.maximum(np.bincount(bin_index), 1)
    means = np.bincount(bin_index, weights=values) / count
    return float(np.var(means[bin_index]) / max(float(np.var(values)), 1e-300))


def compute_running_rms(
    time_s: FloatArray, values: FloatArray, used: Mask
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Mean time (s), rms and its standard error for independent samples, (stretches,) each, in stretches with equal
    numbers (within one) of used samples. time_s, values, used: (n,)."""
    parts = [part for part in np.array_split(np.flatnonzero(used), _BINS) if len(part)]
    rms = np.array([float(np.sqrt(np.mean(values[part] ** 2))) for part in parts])
    error = np.array([float(np.std(values[part] ** 2) / np.sqrt(len(part))) for part in parts])
    return np.array([float(time_s[part].mean()) for part in parts]), rms, error / np.maximum(2 * rms, 1e-300)


def _compute_edges(x: FloatArray, bins: int) -> FloatArray:
    """Edges of fewer than `bins` bins, rising: half at quantiles, half at equal widths between the 0.1 % and 99.9 %
    quantiles, so that both the middle and the ends are covered. Callers add values beyond the ends to the outer bins.
    x: (n,)."""
    low, high = np.quantile(x, [0.001, 0.999])
    # A channel that rests most of the time would have all its bins at rest.
    moving_samples = x[np.abs(x - np.median(x)) > _REST_SHARE * (high - low)]
    quantile_edges = np.quantile(moving_samples if len(moving_samples) else x, np.linspace(0, 1, bins // 2))
    return np.unique(np.concatenate([quantile_edges, np.linspace(low, high, bins // 2)]))


def _compute_block_mean(values: FloatArray, blocks: npt.NDArray[np.int_]) -> tuple[float, float]:
    """Mean and its standard error by the formula of the module; for a single block, the standard deviation of
    values."""
    _, block_index = np.unique(blocks, return_inverse=True)
    weight = np.bincount(block_index).astype(float)
    means = np.bincount(block_index, weights=values) / weight
    mean = float(values.mean())
    if len(means) < 2:
        return mean, float(values.std())
    return mean, float(np.sqrt(np.sum((weight * (means - mean)) ** 2)) / weight.sum())
