"""All laws of a balance together: what no sum of a few should be expected to beat."""

from collections.abc import Sequence

import numpy as np

from analysis.diagnosis.balance.blocks import errors_of, parts_of, shrunk, with_prior
from analysis.diagnosis.balance.regression import Regression
from equalizer.signals.signal import FloatArray

RIDGES = tuple(10.0**exponent for exponent in range(-8, 1))
"""Of the mean power of a column: shrinkages of the sum of all laws, of which folds choose."""


def of_everything(regression: Regression, columns: Sequence[int]) -> tuple[float, FloatArray]:
    """All of these columns together, shrunk towards the base alone as much as folds ask for: its crossed error, and
    each test block's. What no sum of a few laws should be expected to beat: a ceiling."""
    free = np.array([k < regression.base for k in columns])
    own = parts_of(regression.fit, columns)
    whole = own[0].sum(axis=0), own[1].sum(axis=0)
    rest = with_prior((whole[0] - own[0], whole[1] - own[1]), regression.prior)
    whole = with_prior(whole, regression.prior)
    errors = [float(errors_of(regression.fit, own, shrunk(rest, ridge, free)).sum()) for ridge in RIDGES]
    best = int(np.argmin(errors))
    found = shrunk(whole, RIDGES[best], free)
    return errors[best], errors_of(regression.test, parts_of(regression.test, columns), found)
