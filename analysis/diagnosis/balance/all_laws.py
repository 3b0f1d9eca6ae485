"""Ridge regression on all laws of a balance at once: a lower bound of the error that a sum of a few laws may reach."""

from collections.abc import Sequence

import numpy as np

from analysis.diagnosis.balance.blocks import products_per_block, solve_ridge, squared_errors, with_prior
from analysis.diagnosis.balance.regression import Regression
from equalizer.signals.signal import FloatArray

RIDGES = tuple(10.0**exponent for exponent in range(-8, 1))
"""Ridge over the mean power of a column; cross-validation chooses among them."""


def fit_all_laws(regression: Regression, columns: Sequence[int]) -> tuple[float, FloatArray]:
    """Sum of squares with all these columns, the laws' weights shrunk by the ridge that cross-validation chooses: the
    cross-validated one, and that of each test block (blocks,). A lower bound for sums of a few laws."""
    free = np.array([k < regression.base for k in columns])
    own = products_per_block(regression.fit, columns)
    whole = own[0].sum(axis=0), own[1].sum(axis=0)
    rest = with_prior((whole[0] - own[0], whole[1] - own[1]), regression.prior)
    whole = with_prior(whole, regression.prior)
    errors = [float(squared_errors(regression.fit, own, solve_ridge(rest, ridge, free)).sum()) for ridge in RIDGES]
    best = int(np.argmin(errors))
    found = solve_ridge(whole, RIDGES[best], free)
    return errors[best], squared_errors(regression.test, products_per_block(regression.test, columns), found)
