"""Sample autocovariances of a time series, from which an autoregression is fitted (Yule 1927, Walker 1931)."""

import numpy as np

from equalizer.signals.signal import FloatArray


def lagged_products(series: FloatArray, lags: int) -> FloatArray:
    """(lags + 1, c): sample autocovariances, not normalised, of a time series (n, c); missing samples count as 0."""
    filled: FloatArray = np.where(np.isfinite(series).all(axis=1, keepdims=True), series, 0.0)
    return np.array([np.sum(filled[k:] * filled[: max(len(filled) - k, 0)], axis=0) for k in range(lags + 1)])
