import numpy as np
import pytest

from analysis.diagnosis.data.correlated_residuals import compute_lagged_products


@pytest.mark.parametrize("count", [1, 5, 8])
def test_a_time_series_shorter_than_the_lags_has_no_products_beyond_its_length(count):
    """Before, a part of a recording that was shorter than the whitening filter ended the diagnosis."""
    found = compute_lagged_products(np.ones((count, 2)), 6)
    assert found[:, 0].tolist() == [max(count - lag, 0) for lag in range(7)]
    assert np.array_equal(found[:, 0], found[:, 1])
