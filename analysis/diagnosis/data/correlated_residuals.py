"""Statistics of residuals that are correlated from sample to sample: autocovariances, and the bootstrap over blocks.

An autoregression is fitted to sample autocovariances (Yule 1927, Walker 1931). The lower bound of a gain on held-out
data is found by resampling whole blocks, not samples (Kunsch, Ann. Stat. 17:1217, 1989).
"""

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from analysis.diagnosis.settings import BOOTSTRAP_DRAWS, BOOTSTRAP_LEVEL, BOOTSTRAP_SEED
from equalizer.signals.signal import FloatArray


def bootstrap_draws(block_count: int) -> npt.NDArray[np.int64]:
    """(`BOOTSTRAP_DRAWS`, blocks): indices of blocks drawn with replacement, always the same for a number of blocks."""
    return np.random.default_rng(BOOTSTRAP_SEED).integers(block_count, size=(BOOTSTRAP_DRAWS, block_count))


def gain_with_bound(errors_without: FloatArray, errors_with: FloatArray) -> tuple[float, float]:
    """Share of the error power that a law removes, and its lower bound by bootstrap over blocks.
    errors_without, errors_with: (blocks,), sums of squares without and with the law."""
    draws = bootstrap_draws(len(errors_without))
    shares = 1 - errors_with[draws].sum(axis=1) / np.maximum(errors_without[draws].sum(axis=1), 1e-300)
    return float(1 - errors_with.sum() / max(float(errors_without.sum()), 1e-300)), float(
        np.quantile(shares, BOOTSTRAP_LEVEL)
    )


def agrees_with_folds(held_out: Sequence[FloatArray], folds: Sequence[FloatArray]) -> bool:
    """Whether a law has a gain on the held-out blocks, and a significant gain on these and the folds of
    cross-validation together. held_out, folds: each a pair of errors (blocks,), without the law and with it."""
    _, lower_bound = gain_with_bound(*(np.concatenate(errors) for errors in zip(held_out, folds, strict=True)))
    return lower_bound > 0 and gain_with_bound(*held_out)[0] > 0


def compute_lagged_products(series: FloatArray, largest_lag: int) -> FloatArray:
    """(lags + 1, c): sample autocovariances, not normalised, of a time series (n, c); missing samples count as 0."""
    finite_series: FloatArray = np.where(np.isfinite(series).all(axis=1, keepdims=True), series, 0.0)
    return np.array(
        [
            np.sum(finite_series[k:] * finite_series[: max(len(finite_series) - k, 0)], axis=0)
            for k in range(largest_lag + 1)
        ]
    )
