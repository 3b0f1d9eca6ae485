"""Figures with 95 % intervals: shares after Wilson, medians and means by bootstrap."""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import TypeVar

import numpy as np
from statsmodels.stats.proportion import proportion_confint

from equalizer.signals.signal import FloatArray

Item = TypeVar("Item")
RESAMPLED = 2000
"""Draws of a bootstrap interval."""


@dataclass(frozen=True, slots=True)
class Figure:
    """A share (of `of` draws `hits`), or a statistic of `of` values (`hits` None), with its 95 % interval."""

    name: str
    value: float | None
    """The share; None without any case."""
    low: float | None
    high: float | None
    of: int
    hits: int | None = None


def share(name: str, among: Sequence[Item], right: Callable[[Item], bool]) -> Figure:
    """Share of the items that are right, with Wilson's interval; without a value where there are no items."""
    hits, of = sum(right(each) for each in among), len(among)
    if not of:
        return Figure(name, None, None, None, 0, 0)
    low, high = wilson(hits, of)
    return Figure(name, hits / of, low, high, of, hits)


def wilson(hits: float, of: int) -> tuple[float, float]:
    """Wilson's 95 % score interval of a proportion. of: at least 1."""
    low, high = proportion_confint(hits, of, method="wilson")
    return float(low), float(high)


def pool_share(name: str, groups: Sequence[Sequence[bool]]) -> Figure:
    """Pooled share of dependent groups: groups are resampled as a whole (cluster bootstrap)."""
    hits = np.array([sum(group) for group in groups if group], dtype=np.float64)
    of = np.array([len(group) for group in groups if group], dtype=np.float64)
    if not len(of):
        return Figure(name, None, None, None, 0, 0)
    drawn = np.random.default_rng(21).integers(len(of), size=(RESAMPLED, len(of)))
    low, high = np.quantile(hits[drawn].sum(axis=1) / of[drawn].sum(axis=1), (0.025, 0.975))
    return Figure(name, float(hits.sum() / of.sum()), float(low), float(high), int(of.sum()), int(hits.sum()))


def statistic(name: str, values: Iterable[float], reduce: Callable[..., FloatArray]) -> Figure:
    """of: takes (resamples, values) and axis=1, such as np.median. Bootstrap intervals, always the same."""
    known = np.array([value for value in values if np.isfinite(value)], dtype=np.float64)
    if not len(known):
        return Figure(name, None, None, None, 0)
    value = float(reduce(known[None, :], axis=1)[0])
    drawn = np.random.default_rng(20).integers(len(known), size=(RESAMPLED, len(known)))
    low, high = np.quantile(reduce(known[drawn], axis=1), (0.025, 0.975))
    return Figure(name, value, float(low), float(high), len(known))
