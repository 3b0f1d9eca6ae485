"""Calibration of stated probabilities: reliability curve and expected calibration error, in bins of equal count.

    error = sum over bins of |sum of stated probabilities - number of right names| / number of names

Its interval is the percentile bootstrap over names (2.5 and 97.5 %).
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from analysis.evaluation.blind_test.confidence_intervals import RESAMPLED, wilson
from analysis.evaluation.blind_test.outcome import Outcome
from equalizer.signals.signal import FloatArray

BINS = 10
"""Bins of the calibration curve, with equally many answers each."""
TIED = 3
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


def calibration(outcomes: Sequence[Outcome], kinds: Sequence[str] = ANSWERABLE) -> Calibration:
    """Calibration over all named effects of the cases of these kinds: a name is right where the device has the effect,
    at any axis."""
    named = [(outcome, effect) for outcome in outcomes if outcome.kind in kinds for effect in outcome.named]
    if not named:
        return Calibration(None, None, None, ())
    stated = np.array([effect.probability for _, effect in named])
    right = np.array([float(effect.effect in each.names) for each, effect in named])
    drawn = np.random.default_rng(21).integers(len(named), size=(RESAMPLED, len(named)))
    low, high = np.quantile([_calibration_error(stated[k], right[k]) for k in drawn], (0.025, 0.975))
    return Calibration(_calibration_error(stated, right), float(low), float(high), tuple(_make_bins(stated, right)))


def _split_bins(stated: FloatArray) -> list[np.ndarray[tuple[int], np.dtype[np.int64]]]:
    """Indices of the names in each bin, in rising order of probability; at most `BINS`, none empty."""
    order = np.argsort(stated, kind="stable")
    return [part for part in np.array_split(order, BINS) if len(part)]


def _calibration_error(stated: FloatArray, right: FloatArray) -> float:
    """Expected calibration error by the equation of this file. right: 1 for a right name, else 0."""
    even = _average_ties(stated, right)
    return float(sum(abs(stated[part].sum() - even[part].sum()) for part in _split_bins(stated)) / len(stated))


def _average_ties(stated: FloatArray, right: FloatArray) -> FloatArray:
    """(n,): for each name, the share of right names among those with the same stated probability."""
    _, group = np.unique(np.round(stated, TIED), return_inverse=True)
    mean: FloatArray = np.bincount(group, weights=right) / np.bincount(group)
    return np.asarray(mean[group])


def _make_bins(stated: FloatArray, right: FloatArray) -> list[Bin]:
    found, even = [], _average_ties(stated, right)
    for part in _split_bins(stated):
        hits, of = float(even[part].sum()), len(part)
        found.append(Bin(float(stated[part].mean()), hits / of, *wilson(hits, of), of))
    return found
