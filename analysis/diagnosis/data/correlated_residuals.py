"""Statistics of residuals that are correlated from sample to sample: autocovariances, and the bootstrap over blocks.

An autoregression is fitted to sample autocovariances (Yule 1927, Walker 1931). The lower bound of a gain on held-out
data is found by resampling whole blocks, not samples (Kunsch, Ann. Stat. 17:1217, 1989).
"""

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from analysis.diagnosis.settings import BOOTSTRAP_DRAWS, BOOTSTRAP_LEVEL, BOOTSTRAP_SEED
from equalizer.signals.signal import FloatArray


def bootstrap_draws(blocks: int) -> npt.NDArray[np.int64]:
    """(`BOOTSTRAP_DRAWS`, blocks): indices of blocks drawn with replacement, always the same for a number of blocks."""
    return np.random.default_rng(BOOTSTRAP_SEED).integers(blocks, size=(BOOTSTRAP_DRAWS, blocks))


def gain_with_bound(without: FloatArray, with_it: FloatArray) -> tuple[float, float]:
    """Share of the error power that a law removes, and its lower bound by bootstrap over blocks. without, with_it:
    (blocks,), sums of squares without and with the law."""
    drawn = bootstrap_draws(len(without))
    shares = 1 - with_it[drawn].sum(axis=1) / np.maximum(without[drawn].sum(axis=1), 1e-300)
    return float(1 - with_it.sum() / max(float(without.sum()), 1e-300)), float(np.quantile(shares, BOOTSTRAP_LEVEL))


def agrees_with_folds(held: Sequence[FloatArray], folds: Sequence[FloatArray]) -> bool:
    """Whether a law has a gain on the held-out blocks, and a significant gain on these and the folds of
    cross-validation together. held, folds: each a pair of errors (blocks,), without the law and with it."""
    _, low = gain_with_bound(*(np.concatenate(each) for each in zip(held, folds, strict=True)))
    return low > 0 and gain_with_bound(*held)[0] > 0


def compute_lagged_products(series: FloatArray, lags: int) -> FloatArray:
    """(lags + 1, c): sample autocovariances, not normalised, of a time series (n, c); missing samples count as 0."""
    filled: FloatArray = np.where(np.isfinite(series).all(axis=1, keepdims=True), series, 0.0)
    return np.array([np.sum(filled[k:] * filled[: max(len(filled) - k, 0)], axis=0) for k in range(lags + 1)])
