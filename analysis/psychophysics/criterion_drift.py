"""Change of a response bias during a session: a straight line through the criteria of its runs, and its test.

Each criterion has the variance of two binomial z scores (N. A. Macmillan, C. D. Creelman, Detection Theory: A User's
Guide, 2nd ed. (2005), chapter 13). Criteria differ between runs by more than that, without any order, so variances are
multiplied by a dispersion, at least 1: chi squared about the line over its degrees of freedom (P. McCullagh, J. A.
Nelder, Generalized Linear Models, 2nd ed. (1989), section 4.5). Five runs leave 3 degrees of freedom, too few to tell
much, so a session's dispersion is moderated by that of all sessions of the study (G. K. Smyth, Stat. Appl. Genet. Mol.
Biol. 3 (2004), article 3). Where it is above 1 it is an estimate, and the test Student's.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from statistics import NormalDist

from scipy.stats import t as student

from analysis.psychophysics.bias import criterion_variance, response_bias


@dataclass(frozen=True, slots=True)
class CriterionDrift:
    """Change of the criterion during a session."""

    per_100_trials: float
    """Of c, in units of d'."""
    p: float
    """Two-sided, against no drift."""
    p_without_a_run: float
    """The largest p that leaving out a single run gives: one odd run is no drift."""


FEWEST_RUNS = 4
"""Without one of them, three must still show it: two criteria differ, but do not drift."""
SHARED_FREEDOM = 6
"""Degrees of freedom with which the dispersion of all sessions counts beside a session's own (the d0 of Smyth, chosen
by hand; of five runs a session has 3)."""

_Point = tuple[float, float, float]
"""Of a run: trials before its middle, criterion, and weight, which is one over its binomial variance."""
_Run = tuple[Sequence[int], Sequence[bool]]
"""As for `response_bias`."""


def criterion_drifts(sessions: Sequence[Sequence[_Run]]) -> tuple[CriterionDrift | None, ...]:
    """Drift of the response criterion by session: weighted regression of the criteria of its runs on the number of
    trials before their middles. sessions: of one study, each with its runs in their order. None with fewer than
    `FEWEST_RUNS` that have both directions.
    """
    lines = [_line(runs) for runs in sessions]
    fits = [_fit(points) for points in lines if points is not None]
    freedom = sum(fit.freedom for fit in fits)
    shared = max(1.0, sum(fit.chi_squared for fit in fits) / freedom) if fits else 1.0
    return tuple(None if points is None else _drift(points, shared, freedom) for points in lines)


@dataclass(frozen=True, slots=True)
class _Fit:
    """Straight line fitted by weighted least squares."""

    slope: float
    z: float
    """Slope over its standard error, where all variance is binomial."""
    chi_squared: float
    freedom: int


def _line(runs: Sequence[_Run]) -> list[_Point] | None:
    points, before = list[_Point](), 0
    for shown, correct in runs:
        if (bias := response_bias(shown, correct)) is not None:
            points.append((before + len(shown) / 2.0, bias.criterion, 1.0 / _criterion_variance(shown, correct)))
        before += len(shown)
    return points if len(points) >= FEWEST_RUNS else None


def _fit(points: Sequence[_Point]) -> _Fit:
    weight = sum(w for _, _, w in points)
    middle = sum(w * place for place, _, w in points) / weight
    mean = sum(w * criterion for _, criterion, w in points) / weight
    spread = sum(w * (place - middle) ** 2 for place, _, w in points)
    slope = sum(w * (place - middle) * criterion for place, criterion, w in points) / spread
    chi_squared = sum(w * (criterion - mean - slope * (place - middle)) ** 2 for place, criterion, w in points)
    return _Fit(slope, slope * math.sqrt(spread), chi_squared, len(points) - 2)


def _drift(points: Sequence[_Point], shared: float, all_freedom: int) -> CriterionDrift:
    """shared: dispersion of all sessions, all_freedom: its degrees of freedom."""
    fit = _fit(points)
    freedom = fit.freedom + SHARED_FREEDOM
    dispersion = (fit.chi_squared + SHARED_FREEDOM * shared) / freedom
    # A session alone shares its own dispersion, which has no more degrees of freedom than that.
    freedom = min(freedom, all_freedom)
    others = [_fit([*points[:left], *points[left + 1 :]]).z for left in range(len(points))]
    return CriterionDrift(
        100.0 * fit.slope, _p(fit.z, dispersion, freedom), max(_p(z, dispersion, freedom) for z in others)
    )


def _p(z: float, dispersion: float, freedom: int) -> float:
    """Two-sided; a dispersion of 1 or less counts as 1, which is no estimate. Not continuous there: Student's test
    throughout would name far fewer of the drifts (docs/statistics.md)."""
    if dispersion <= 1.0:
        return 2.0 * NormalDist().cdf(-abs(z))
    return float(2.0 * student.sf(abs(z) / math.sqrt(dispersion), freedom))


def _criterion_variance(directions_shown: Sequence[int], correct: Sequence[bool]) -> float:
    """Variance of a run's criterion, computed at its share of right answers for both directions, as without a bias: at
    the rates of the run itself, runs with a strong bias would count for little."""
    first = sum(shown == 1 for shown in directions_shown)
    return criterion_variance(sum(correct), first, len(directions_shown) - first)
