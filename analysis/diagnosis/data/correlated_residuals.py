"""Statistics of residuals that are correlated from sample to sample: sample autocovariances and the block bootstrap.

The autocovariances serve to fit an autoregression (Yule 1927, Walker 1931). The lower bound of a gain is found by
resampling blocks of samples instead of single samples (Kunsch, Ann. Stat. 17:1217, 1989).
"""

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from analysis.diagnosis.limits import BOOTSTRAP_DRAWS, BOOTSTRAP_LEVEL, BOOTSTRAP_SEED
from equalizer.signals.signal import FloatArray


def draw_bootstrap_blocks(block_count: int) -> npt.NDArray[np.int64]:
    """Draw indices of blocks (`BOOTSTRAP_DRAWS`, blocks) with replacement. The seed is fixed, so that the draws are the
    same for the same number of blocks."""
    return np.random.default_rng(BOOTSTRAP_SEED).integers(block_count, size=(BOOTSTRAP_DRAWS, block_count))


def bootstrap_gain(errors_without: FloatArray, errors_with: FloatArray) -> tuple[float, float]:
    """Compute the gain of a law, the share of the error power that it removes, and the lower bound of the gain: the
    quantile `BOOTSTRAP_LEVEL` of a bootstrap over blocks. errors_without, errors_with: (blocks,), sums of squares
    without and with the law."""
    draws = draw_bootstrap_blocks(len(errors_without))
    drawn_gains = 1 - errors_with[draws].sum(axis=1) / np.maximum(errors_without[draws].sum(axis=1), 1e-300)
    return float(1 - errors_with.sum() / max(float(errors_without.sum()), 1e-300)), float(
        np.quantile(drawn_gains, BOOTSTRAP_LEVEL)
    )


def is_confirmed_by_folds(held_out: Sequence[FloatArray], folds: Sequence[FloatArray]) -> bool:
    """Whether the gain of a law is positive on the held-out blocks, and its lower bound is positive on the held-out
    blocks and the folds of cross-validation together. held_out, folds: each a pair of errors (blocks,), without the law
    and with it."""
    _, lower_bound = bootstrap_gain(*(np.concatenate(errors) for errors in zip(held_out, folds, strict=True)))
    return lower_bound > 0 and bootstrap_gain(*held_out)[0] > 0


def compute_lagged_products(series: FloatArray, largest_lag: int) -> FloatArray:
    """Compute (largest_lag + 1, c): sums of x[t + k] x[t] for lags k = 0..largest_lag of each channel of a time series
    (n, c): autocovariances, neither centred nor divided by n. A sample with a NaN in any channel counts as 0 in all."""
    finite_series: FloatArray = np.where(np.isfinite(series).all(axis=1, keepdims=True), series, 0.0)
    return np.array(
        [
            np.sum(finite_series[k:] * finite_series[: max(len(finite_series) - k, 0)], axis=0)
            for k in range(largest_lag + 1)
        ]
    )
