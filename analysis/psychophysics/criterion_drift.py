"""Drift of the response criterion during a session: weighted linear regression over its runs, and test of its slope.

Each criterion has the variance of two binomial z scores (N. A. Macmillan, C. D. Creelman, Detection Theory: A User's
Guide, 2nd ed. (2005), chapter 13); its inverse is the weight. Criteria of different runs scatter by more than that
without any trend, so variances are multiplied by a dispersion, at least 1: chi squared about the line over its degrees
of freedom nu (P. McCullagh, J. A. Nelder, Generalized Linear Models, 2nd ed. (1989), section 4.5). Five runs leave
nu = 3, too few for a precise estimate. A session's dispersion is therefore moderated by the dispersion s0 of all
sessions of the study, with d0 prior degrees of freedom (G. K. Smyth, Stat. Appl. Genet. Mol. Biol. 3 (2004), article
3): (chi squared + d0 s0) / (nu + d0). Above 1 it is an estimate, and the slope is tested by Student's t; else by z.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from statistics import NormalDist

from scipy.stats import t as student

from analysis.psychophysics.bias import criterion_variance, response_bias


@dataclass(frozen=True, slots=True)
class CriterionDrift:
    """Linear change of the criterion c during a session."""

    per_100_trials: float
    """Change of c in 100 trials, in units of d'."""
    p: float
    """Two-sided p value of the slope, against no drift."""
    p_without_a_run: float
    """The largest p value with a single run left out: one unusual run is no drift."""


FEWEST_RUNS = 4
"""Fewest runs with a criterion. With one left out (`p_without_a_run`), three remain; two would always fit a line."""
SHARED_FREEDOM = 6
"""Prior degrees of freedom of the dispersion of all sessions (d0 of Smyth), chosen by hand. A session of five runs has
3 of its own."""

_Point = tuple[float, float, float]
"""A run: number of trials before its middle, criterion, and weight (one over the criterion's binomial variance)."""
_Run = tuple[Sequence[int], Sequence[bool]]
"""A run's directions shown (1 or 2) and whether each answer was right, as for `response_bias`."""


def criterion_drifts(sessions: Sequence[Sequence[_Run]]) -> tuple[CriterionDrift | None, ...]:
    """Drift of the response criterion, per session: weighted regression of the criteria of its runs on the number of
    trials before their middles. sessions: of one study, each with its runs in order. None for a session with fewer than
    `FEWEST_RUNS` runs in which both directions were shown.
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
    """Slope over its standard error, if all variance were binomial (dispersion 1)."""
    chi_squared: float
    freedom: int


def _line(runs: Sequence[_Run]) -> list[_Point] | None:
    """Points of the regression; None with fewer than `FEWEST_RUNS`."""
    points, before = list[_Point](), 0
    for shown, correct in runs:
        if (bias := response_bias(shown, correct)) is not None:
            points.append((before + len(shown) / 2.0, bias.criterion, 1.0 / _criterion_variance(shown, correct)))
        before += len(shown)
    return points if len(points) >= FEWEST_RUNS else None


def _fit(points: Sequence[_Point]) -> _Fit:
    """Weighted least squares of the criteria on the number of trials."""
    weight = sum(w for _, _, w in points)
    middle = sum(w * place for place, _, w in points) / weight
    mean = sum(w * criterion for _, criterion, w in points) / weight
    spread = sum(w * (place - middle) ** 2 for place, _, w in points)
    slope = sum(w * (place - middle) * criterion for place, criterion, w in points) / spread
    chi_squared = sum(w * (criterion - mean - slope * (place - middle)) ** 2 for place, criterion, w in points)
    return _Fit(slope, slope * math.sqrt(spread), chi_squared, len(points) - 2)


def _drift(points: Sequence[_Point], shared: float, all_freedom: int) -> CriterionDrift:
    """Slope of a session and its tests. shared: dispersion of all sessions; all_freedom: its degrees of freedom."""
    fit = _fit(points)
    freedom = fit.freedom + SHARED_FREEDOM
    dispersion = (fit.chi_squared + SHARED_FREEDOM * shared) / freedom
    # In a study of one session the shared dispersion is its own: it adds no degrees of freedom.
    freedom = min(freedom, all_freedom)
    others = [_fit([*points[:left], *points[left + 1 :]]).z for left in range(len(points))]
    return CriterionDrift(
        100.0 * fit.slope, _p(fit.z, dispersion, freedom), max(_p(z, dispersion, freedom) for z in others)
    )


def _p(z: float, dispersion: float, freedom: int) -> float:
    """Two-sided p value. A dispersion of 1 or less counts as 1, a known value: normal test; above 1 it is estimated:
    Student's test. The p value jumps at 1. Student's test throughout would be continuous, but would detect far fewer
    drifts (docs/statistics.md)."""
    if dispersion <= 1.0:
        return 2.0 * NormalDist().cdf(-abs(z))
    return float(2.0 * student.sf(abs(z) / math.sqrt(dispersion), freedom))


def _criterion_variance(directions_shown: Sequence[int], correct: Sequence[bool]) -> float:
    """Variance of a run's criterion, computed for both directions at the run's overall share of right answers, as if
    there were no bias. With the rates of each direction, runs with a strong bias would get little weight."""
    first = sum(shown == 1 for shown in directions_shown)
    return criterion_variance(sum(correct), first, len(directions_shown) - first)
