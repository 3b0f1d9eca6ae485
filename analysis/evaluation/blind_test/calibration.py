"""Calibration of stated probabilities: reliability curve and expected calibration error, in bins of equal count.

    error = sum over bins of |sum of stated probabilities - number of right names| / number of names

Its interval is the percentile bootstrap over names (2.5 and 97.5 %).
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from analysis.evaluation.blind_test.confidence_intervals import RESAMPLE_COUNT, compute_wilson_interval
from analysis.evaluation.blind_test.outcome import Outcome
from equalizer.signals.signal import FloatArray

BINS = 10
"""Bins of the calibration curve, with equally many answers each."""
TIE_DECIMALS = 3
"""Decimals to which probabilities are rounded for comparison. Names of equal probability share their right answers
equally, so that the bin into which each falls does not matter."""
ANSWERABLE = ("nothing", "single", "pair")
"""Kinds whose answer is in the catalogue, to which the stated probabilities refer."""


@dataclass(frozen=True, slots=True)
class Bin:
    """A bin of names with similar stated probabilities, and the share of these names that are right."""

    stated: float
    """Mean stated probability of its names."""
    right: float
    """Share of its names that are right."""
    low: float
    """Lower end of Wilson's 95 % interval of `right`."""
    high: float
    """Upper end of that interval."""
    of: int
    """Number of its names."""


@dataclass(frozen=True, slots=True)
class Calibration:
    """Expected calibration error of stated probabilities with its 95 % interval, and the bins of the reliability
    curve."""

    error: float | None
    """Expected calibration error; None where nothing was named."""
    low: float | None
    high: float | None
    bins: tuple[Bin, ...]


def compute_calibration(outcomes: Sequence[Outcome], kinds: Sequence[str] = ANSWERABLE) -> Calibration:
    """Calibration over all named effects of the cases of these kinds: a name is right where the device has the effect,
    at any axis."""
    names = [(outcome, effect) for outcome in outcomes if outcome.kind in kinds for effect in outcome.named]
    if not names:
        return Calibration(None, None, None, ())
    probabilities = np.array([effect.probability for _, effect in names])
    is_right = np.array([float(effect.effect in case.names) for case, effect in names])
    resamples = np.random.default_rng(21).integers(len(names), size=(RESAMPLE_COUNT, len(names)))
    low, high = np.quantile(
        [_compute_calibration_error(probabilities[k], is_right[k]) for k in resamples], (0.025, 0.975)
    )
    return Calibration(
        _compute_calibration_error(probabilities, is_right),
        float(low),
        float(high),
        tuple(_make_bins(probabilities, is_right)),
    )


def _split_bins(probabilities: FloatArray) -> list[np.ndarray[tuple[int], np.dtype[np.int64]]]:
    """Indices of the names in each bin, in rising order of probability; at most `BINS`, none empty."""
    order = np.argsort(probabilities, kind="stable")
    return [part for part in np.array_split(order, BINS) if len(part)]


def _compute_calibration_error(probabilities: FloatArray, is_right: FloatArray) -> float:
    """Expected calibration error by the equation of this file. is_right: 1 for a right name, else 0."""
    tied_shares = _average_ties(probabilities, is_right)
    return float(
        sum(abs(probabilities[part].sum() - tied_shares[part].sum()) for part in _split_bins(probabilities))
        / len(probabilities)
    )


def _average_ties(probabilities: FloatArray, is_right: FloatArray) -> FloatArray:
    """(n,): for each name, the share of right names among those with the same stated probability."""
    _, group = np.unique(np.round(probabilities, TIE_DECIMALS), return_inverse=True)
    group_means: FloatArray = np.bincount(group, weights=is_right) / np.bincount(group)
    return np.asarray(group_means[group])


def _make_bins(probabilities: FloatArray, is_right: FloatArray) -> list[Bin]:
    bins, tied_shares = [], _average_ties(probabilities, is_right)
    for part in _split_bins(probabilities):
        hits, count = float(tied_shares[part].sum()), len(part)
        bins.append(Bin(float(probabilities[part].mean()), hits / count, *compute_wilson_interval(hits, count), count))
    return bins
