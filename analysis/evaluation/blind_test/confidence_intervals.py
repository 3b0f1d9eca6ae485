"""Shares, medians and means of a blind test, each with a 95 % confidence interval.

A share of independent cases has Wilson's score interval, which holds for few cases and for shares near 0 and 1. A share
of cases that come in dependent groups, and a median or mean, have a percentile bootstrap interval.

References: Wilson, Journal of the American Statistical Association 22 (1927), 209; Efron and Tibshirani, An
Introduction to the Bootstrap (1993), chapter 13; Davison and Hinkley, Bootstrap Methods and their Application (1997),
section 3.8 (groups resampled as a whole).
"""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import TypeVar

import numpy as np
from statsmodels.stats.proportion import proportion_confint

from equalizer.signals.signal import FloatArray

Item = TypeVar("Item")
RESAMPLE_COUNT = 2000
"""Number of resamples of a bootstrap interval. Chosen: 50 resamples lie beyond each end."""
_QUANTILES = (0.025, 0.975)
"""Quantiles of the resamples that are the ends of a 95 % interval."""
_GROUP_SEED, _VALUE_SEED = 21, 20
"""Seeds of the resamples, fixed so that the same cases always give the same interval; any values serve."""


@dataclass(frozen=True, slots=True)
class IntervalEstimate:
    """Estimate of a share, or of a statistic of values, with its 95 % confidence interval."""

    name: str
    value: float | None
    """The share (0 to 1), or the statistic in the unit of its values; None without any case."""
    low: float | None
    """Lower end of the interval."""
    high: float | None
    """Upper end of the interval."""
    of: int
    """Number of cases, or of values."""
    hits: int | None = None
    """Number of cases that count towards a share; None for a statistic."""


def compute_share(name: str, items: Sequence[Item], is_hit: Callable[[Item], bool]) -> IntervalEstimate:
    """Compute the share of the items for which `is_hit` is true, with Wilson's interval; without a value where there
    are no items."""
    hits, count = sum(is_hit(item) for item in items), len(items)
    if not count:
        return IntervalEstimate(name, None, None, None, 0, 0)
    low, high = compute_wilson_interval(hits, count)
    return IntervalEstimate(name, hits / count, low, high, count, hits)


def compute_wilson_interval(hits: float, trials: int) -> tuple[float, float]:
    """Compute lower and upper end of Wilson's 95 % score interval of a proportion. hits: number of successes, 0 to
    `trials`. trials: at least 1."""
    low, high = proportion_confint(hits, trials, method="wilson")
    return float(low), float(high)


def pool_share(name: str, groups: Sequence[Sequence[bool]]) -> IntervalEstimate:
    """Compute the share of true items in all groups together, whose items depend on each other: the interval resamples
    groups as a whole (cluster bootstrap). Empty groups are left out; without a value where all are empty."""
    group_hits = np.array([sum(group) for group in groups if group], dtype=np.float64)
    group_sizes = np.array([len(group) for group in groups if group], dtype=np.float64)
    if not len(group_sizes):
        return IntervalEstimate(name, None, None, None, 0, 0)
    resamples = np.random.default_rng(_GROUP_SEED).integers(len(group_sizes), size=(RESAMPLE_COUNT, len(group_sizes)))
    low, high = np.quantile(group_hits[resamples].sum(axis=1) / group_sizes[resamples].sum(axis=1), _QUANTILES)
    return IntervalEstimate(
        name,
        float(group_hits.sum() / group_sizes.sum()),
        float(low),
        float(high),
        int(group_sizes.sum()),
        int(group_hits.sum()),
    )


def compute_statistic(name: str, values: Iterable[float], statistic: Callable[..., FloatArray]) -> IntervalEstimate:
    """Compute a statistic of the finite values, with its bootstrap interval; without a value where none is finite.

    statistic: function of an array (resamples, values) and `axis=1`, such as np.median or np.mean.
    """
    finite_values = np.array([value for value in values if np.isfinite(value)], dtype=np.float64)
    if not len(finite_values):
        return IntervalEstimate(name, None, None, None, 0)
    value = float(statistic(finite_values[None, :], axis=1)[0])
    resamples = np.random.default_rng(_VALUE_SEED).integers(
        len(finite_values), size=(RESAMPLE_COUNT, len(finite_values))
    )
    low, high = np.quantile(statistic(finite_values[resamples], axis=1), _QUANTILES)
    return IntervalEstimate(name, value, float(low), float(high), len(finite_values))
