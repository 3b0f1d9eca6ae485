"""Calibration of stated probabilities: reliability curve and expected calibration error, in bins of equal count.

    error = sum over bins of |sum of stated probabilities - number of right names| / number of names

Its interval is the percentile bootstrap over names (2.5 and 97.5 %). A name is an effect that a diagnosis named.
Reference: Naeini et al., AAAI 2015.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from analysis.evaluation.blind_test.confidence_intervals import RESAMPLE_COUNT, compute_wilson_interval
from analysis.evaluation.blind_test.outcome import Outcome
from equalizer.signals.signal import FloatArray

BIN_COUNT = 10
"""Largest number of bins of the reliability curve, with about equally many names each. Chosen by hand."""
TIE_DECIMALS = 3
"""Decimals to which probabilities are rounded for comparison. Names of equal probability share their right answers
equally, so that the bin into which each falls does not matter."""
ANSWERABLE_KINDS = ("nothing", "single", "pair")
"""Kinds of case (`Outcome.kind`) whose true answer is in the catalogue, to which the stated probabilities refer."""


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
    """Lower end of its 95 % interval; None where nothing was named."""
    high: float | None
    """Upper end of that interval."""
    bins: tuple[Bin, ...]
    """In the order of rising probability; empty where nothing was named."""


def compute_calibration(outcomes: Sequence[Outcome], kinds: Sequence[str] = ANSWERABLE_KINDS) -> Calibration:
    """Compute the calibration over all named effects of the cases of these kinds: a name is right where the device has
    the effect, at any axis. The bootstrap has a fixed seed (21; any value serves), so that results are reproducible."""
    named_effects = [(outcome, effect) for outcome in outcomes if outcome.kind in kinds for effect in outcome.named]
    if not named_effects:
        return Calibration(None, None, None, ())
    probabilities = np.array([effect.probability for _, effect in named_effects])
    is_right = np.array([float(effect.effect in case.names) for case, effect in named_effects])
    resamples = np.random.default_rng(21).integers(len(named_effects), size=(RESAMPLE_COUNT, len(named_effects)))
    low, high = np.quantile(
        [_compute_calibration_error(probabilities[indices], is_right[indices]) for indices in resamples], (0.025, 0.975)
    )
    return Calibration(
        _compute_calibration_error(probabilities, is_right),
        float(low),
        float(high),
        tuple(_make_bins(probabilities, is_right)),
    )


def _split_into_bins(probabilities: FloatArray) -> list[np.ndarray[tuple[int], np.dtype[np.int64]]]:
    """Split the indices of the names into bins of rising probability; at most `BIN_COUNT`, none empty. probabilities:
    (n,)."""
    order = np.argsort(probabilities, kind="stable")
    return [bin_indices for bin_indices in np.array_split(order, BIN_COUNT) if len(bin_indices)]


def _compute_calibration_error(probabilities: FloatArray, is_right: FloatArray) -> float:
    """Compute the expected calibration error by the equation of this file. is_right: (n,), 1 for a right name, else
    0."""
    tied_shares = _average_ties(probabilities, is_right)
    return float(
        sum(
            abs(probabilities[bin_indices].sum() - tied_shares[bin_indices].sum())
            for bin_indices in _split_into_bins(probabilities)
        )
        / len(probabilities)
    )


def _average_ties(probabilities: FloatArray, is_right: FloatArray) -> FloatArray:
    """Average `is_right` (n,) over the names with the same stated probability, to `TIE_DECIMALS`."""
    _, group_indices = np.unique(np.round(probabilities, TIE_DECIMALS), return_inverse=True)
    group_means: FloatArray = np.bincount(group_indices, weights=is_right) / np.bincount(group_indices)
    return np.asarray(group_means[group_indices])


def _make_bins(probabilities: FloatArray, is_right: FloatArray) -> list[Bin]:
    """Make the bins of the reliability curve; the number of right names of a bin may be a fraction, because tied names
    share their right answers. probabilities, is_right: (n,) each."""
    bins, tied_shares = [], _average_ties(probabilities, is_right)
    for bin_indices in _split_into_bins(probabilities):
        right_count, name_count = float(tied_shares[bin_indices].sum()), len(bin_indices)
        bins.append(
            Bin(
                float(probabilities[bin_indices].mean()),
                right_count / name_count,
                *compute_wilson_interval(right_count, name_count),
                name_count,
            )
        )
    return bins
