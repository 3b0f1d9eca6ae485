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

from scipy.stats import t as student_t

from analysis.psychophysics.bias import compute_criterion_variance, estimate_response_bias


@dataclass(frozen=True, slots=True)
class CriterionDrift:
    """Linear change of the criterion c during a session."""

    per_100_trials: float
    """Change of c in 100 trials, in units of d'."""
    p: float
    """Two-sided p value of the slope, against no drift."""
    p_without_a_run: float
    """Largest p value with a single run left out: a slope that rests on one unusual run is no drift."""


MIN_RUNS = 4
"""Smallest number of runs with a criterion. With a run left out (`p_without_a_run`), three remain; a line fits two
points exactly."""
PRIOR_DEGREES_OF_FREEDOM = 6
"""Prior degrees of freedom of the dispersion of all sessions (d0 of Smyth), chosen by hand."""

_RegressionPoint = tuple[float, float, float]
"""A run: number of trials before its middle, criterion c, and weight (inverse of the criterion's binomial variance)."""
_Run = tuple[Sequence[int], Sequence[bool]]
"""A run's directions shown (1 or 2) and whether each answer was right, as for `estimate_response_bias`."""


def estimate_criterion_drifts(sessions: Sequence[Sequence[_Run]]) -> tuple[CriterionDrift | None, ...]:
    """Estimate the drift of the response criterion per session: weighted regression of the criteria of its runs on the
    number of trials before their middles. sessions: those of one study, each with its runs in order. None for a session
    with fewer than `MIN_RUNS` runs in which both directions were shown.
    """
    points_by_session = [_make_regression_points(runs) for runs in sessions]
    fits = [_fit_line(points) for points in points_by_session if points is not None]
    shared_degrees_of_freedom = sum(fit.degrees_of_freedom for fit in fits)
    shared_dispersion = max(1.0, sum(fit.chi_squared for fit in fits) / shared_degrees_of_freedom) if fits else 1.0
    return tuple(
        None if points is None else _test_drift(points, shared_dispersion, shared_degrees_of_freedom)
        for points in points_by_session
    )


@dataclass(frozen=True, slots=True)
class _LineFit:
    """Straight line fitted by weighted least squares."""

    slope: float
    z: float
    """Slope over its standard error, if all variance were binomial (dispersion 1)."""
    chi_squared: float
    """Weighted sum of squared residuals about the line."""
    degrees_of_freedom: int


def _make_regression_points(runs: Sequence[_Run]) -> list[_RegressionPoint] | None:
    """Make the points of the regression from the runs in which both directions were shown; None with fewer than
    `MIN_RUNS` of them."""
    points, trials_before = list[_RegressionPoint](), 0
    for directions, correct in runs:
        if (bias := estimate_response_bias(directions, correct)) is not None:
            points.append(
                (
                    trials_before + len(directions) / 2.0,
                    bias.criterion,
                    1.0 / _compute_variance_without_bias(directions, correct),
                )
            )
        trials_before += len(directions)
    return points if len(points) >= MIN_RUNS else None


def _fit_line(points: Sequence[_RegressionPoint]) -> _LineFit:
    """Fit the criteria over the number of trials by weighted least squares. points: at least three."""
    total_weight = sum(weight for _, _, weight in points)
    mean_position = sum(weight * position for position, _, weight in points) / total_weight
    mean_criterion = sum(weight * criterion for _, criterion, weight in points) / total_weight
    position_sum_of_squares = sum(weight * (position - mean_position) ** 2 for position, _, weight in points)
    slope = (
        sum(weight * (position - mean_position) * criterion for position, criterion, weight in points)
        / position_sum_of_squares
    )
    chi_squared = sum(
        weight * (criterion - mean_criterion - slope * (position - mean_position)) ** 2
        for position, criterion, weight in points
    )
    return _LineFit(slope, slope * math.sqrt(position_sum_of_squares), chi_squared, len(points) - 2)


def _test_drift(
    points: Sequence[_RegressionPoint], shared_dispersion: float, shared_degrees_of_freedom: int
) -> CriterionDrift:
    """Test the slope of a session. shared_dispersion: dispersion of all sessions (s0), with
    `shared_degrees_of_freedom`."""
    fit = _fit_line(points)
    degrees_of_freedom = fit.degrees_of_freedom + PRIOR_DEGREES_OF_FREEDOM
    dispersion = (fit.chi_squared + PRIOR_DEGREES_OF_FREEDOM * shared_dispersion) / degrees_of_freedom
    # In a study of one session the shared dispersion is its own: it adds no degrees of freedom.
    degrees_of_freedom = min(degrees_of_freedom, shared_degrees_of_freedom)
    z_without_a_run = [_fit_line([*points[:omitted], *points[omitted + 1 :]]).z for omitted in range(len(points))]
    return CriterionDrift(
        100.0 * fit.slope,
        _compute_two_sided_p(fit.z, dispersion, degrees_of_freedom),
        max(_compute_two_sided_p(z, dispersion, degrees_of_freedom) for z in z_without_a_run),
    )


def _compute_two_sided_p(z: float, dispersion: float, degrees_of_freedom: int) -> float:
    """Compute the two-sided p value. A dispersion of 1 or less counts as 1, a known value: normal test; above 1 it is
    estimated: Student's test. The p value jumps at 1. Student's test throughout would be continuous, but would detect
    far fewer drifts (docs/statistics.md)."""
    if dispersion <= 1.0:
        return 2.0 * NormalDist().cdf(-abs(z))
    return float(2.0 * student_t.sf(abs(z) / math.sqrt(dispersion), degrees_of_freedom))


def _compute_variance_without_bias(directions_shown: Sequence[int], correct: Sequence[bool]) -> float:
    """Compute the variance of a run's criterion for both directions at the run's overall share of right answers, as if
    there were no bias. With the rates of each direction, runs with a strong bias would get little weight."""
    first_direction_count = sum(direction == 1 for direction in directions_shown)
    return compute_criterion_variance(
        sum(correct), first_direction_count, len(directions_shown) - first_direction_count
    )
