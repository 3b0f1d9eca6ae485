"""Inference from the hierarchical fit: persons are the sampling units and carry the uncertainty.

Each person's influence on the means is n A^-1 (s_i - mean of s), with A the curvature of the fit and s_i the person's
score. Mean plus influence is a person's pseudo-threshold in dB. If the thresholds were known exactly, it would be the
threshold itself, and the analysis of pseudo-thresholds the usual analysis within participants. The standard errors are
cluster-robust (sandwich) with the factor n / (n - 1), so that they stay valid where spreads are unequal or the family
of curves does not fit.

Source: K.-Y. Liang, S. L. Zeger, Biometrika 73 (1986), 13-22; G. Kauermann, R. J. Carroll, J. Am. Stat. Assoc. 96
(2001), 1387-1396 (few clusters, t with n - 1 degrees of freedom).
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.stats import t as student_t

from analysis.psychophysics.group_contrasts import compute_mean_errors
from analysis.psychophysics.hierarchy.fit import HierarchicalFit
from analysis.psychophysics.hierarchy.objective import Objective, Prior
from analysis.psychophysics.hierarchy.quadrature_search import QuadratureSearch
from equalizer.signals.signal import FloatArray

BOUND_ROOT_TOLERANCE, MOST_BOUND_STEPS = 0.03, 8
"""Tolerance of the signed root of the likelihood ratio at a bound, whose target is about 2.3 (97.5 % becomes 97.4 to
97.6 %), and largest number of steps. A search that uses all steps returns the farther, conservative, end."""
LONGEST_SEARCH_DB = 32.0
"""Farthest search for a bound below the estimate, in dB: a factor of 40 in force. Chosen."""
FEWEST_PEOPLE = 3
"""Least number of participants for a confidence interval of a mean over people; `estimate_medians` states why."""


@dataclass(frozen=True, slots=True)
class MedianThreshold:
    """The median participant's threshold at one frequency, in dB re 1 N."""

    frequency_hz: float
    db: float
    lower_db: float | None
    """Lower bound; None: the answers do not contradict a median `LONGEST_SEARCH_DB` below the estimate, or too few
    people have enough answers (two or fewer for a median up to the cap, one or none for a median above it)."""
    upper_db: float | None
    """Upper bound; None where the median is above the cap: lower_db is then a one-sided bound, and the estimate itself
    is an extrapolation. Also None where two people or fewer have enough answers."""
    above_cap: bool

    @property
    def newton(self) -> float:
        """The estimate in N."""
        return float(10.0 ** (self.db / 20.0))

    @property
    def lower_n(self) -> float | None:
        """Lower bound in N; None where `lower_db` is None."""
        return None if self.lower_db is None else float(10.0 ** (self.lower_db / 20.0))

    @property
    def upper_n(self) -> float | None:
        """Upper bound in N; None where `upper_db` is None."""
        return None if self.upper_db is None else float(10.0 ** (self.upper_db / 20.0))


@dataclass(frozen=True, slots=True)
class DirectionLimit:
    """Frequency at which the median participant's threshold reaches the cap."""

    frequency_hz: float | None
    """None where the median reaches the cap already at the lowest frequency, never reaches it, or crosses it upwards
    more than once."""
    lower_hz: float | None
    """Lower bound; None: at or below the lowest frequency played, or no interval of the median contains the cap."""
    upper_hz: float | None
    """Upper bound; None: at or above the highest frequency played, or no interval of the median contains the cap."""
    words: str
    """Sentences on the limit and its scope, for reports."""


def compute_pseudo_thresholds(fit: HierarchicalFit) -> FloatArray:
    """Compute pseudo-thresholds (n, k) in dB by influence functions: their mean is the estimate of the median
    threshold, their standard deviation over sqrt(n) its standard error."""
    centred = fit.scores - fit.scores.mean(axis=0)
    influence = fit.answers.persons * np.linalg.solve(fit.curvature, centred.T).T
    pseudo_thresholds_db: FloatArray = fit.means_db + influence[:, : fit.layout.k]
    return pseudo_thresholds_db


def estimate_medians(
    fit: HierarchicalFit, cap_db: float, confidence: float, prior: Prior | None = None
) -> tuple[MedianThreshold, ...]:
    """Estimate the median threshold at each frequency. Up to the cap: two-sided t interval over pseudo-thresholds.
    Above it: profile bound at the level of the lower end of a two-sided interval (see `find_lower_bound`). With two
    people at a frequency there is no interval below the cap: with one degree of freedom it would contain nearly every
    threshold."""
    errors = compute_mean_errors(compute_pseudo_thresholds(fit), fit.answers.has_enough_answers)
    half_width = student_t.ppf(0.5 + confidence / 2, errors.df) * errors.error
    medians = []
    for index, frequency_hz in enumerate(fit.answers.frequencies_hz):
        db, people, df = float(fit.means_db[index]), int(errors.people[index]), float(errors.df[index])
        bounds: tuple[float | None, float | None] = None, None
        if db > cap_db and people > 1:
            bounds = find_lower_bound(fit, index, 0.5 + confidence / 2, prior or Prior(), df), None
        elif db <= cap_db and people >= FEWEST_PEOPLE:
            bounds = db - float(half_width[index]), db + float(half_width[index])
        medians.append(MedianThreshold(frequency_hz, db, *bounds, db > cap_db))
    return tuple(medians)


def find_lower_bound(
    fit: HierarchicalFit, index: int, confidence: float, prior: Prior, df: float | None = None
) -> float | None:
    """Find the lower bound in dB of the mean of index `index` by profile likelihood, with the quantile of the t
    distribution in place of the normal one. confidence: one-sided.

    A caller that reports the bound only where the estimate is above the cap must pass (1 + c) / 2 for an interval of
    confidence c: choosing between interval and bound by the data costs coverage near the cap. Source: G. J. Feldman, R.
    D. Cousins, Phys. Rev. D 57 (1998), 3873-3889.

    df: degrees of freedom; None: n - 1 of all persons. Returns None where no bound is found within `LONGEST_SEARCH_DB`
    below the estimate.
    """
    search = QuadratureSearch(Objective(fit.answers, fit.family, prior))
    lowest_cost = search.find_lowest_cost(fit.parameters)
    target_root = float(student_t.ppf(confidence, fit.answers.persons - 1 if df is None else df))
    unit_step = np.eye(len(fit.parameters))[index]
    direction = np.linalg.solve(fit.curvature, unit_step)
    direction = direction / direction[index]

    def compute_root(below_db: float) -> float:
        """Compute the root of the likelihood ratio with the mean fixed below_db under the estimate; linear in
        below_db if the log-likelihood is quadratic."""
        # The other parameters start where a quadratic likelihood has them. With few answers the cost has several
        # minima: where the root reaches its target, a second search starts with the others at the estimate.
        cost = search.find_lowest_cost(fit.parameters - below_db * direction, fixed_index=index)
        if math.sqrt(max(0.0, 2.0 * (cost - lowest_cost))) >= target_root:
            cost = min(cost, search.find_lowest_cost(fit.parameters - below_db * unit_step, fixed_index=index))
        return math.sqrt(max(0.0, 2.0 * (cost - lowest_cost)))

    inner_db, inner_root, outer_db = 0.0, 0.0, 2.0
    while (outer_root := compute_root(outer_db)) < target_root:
        inner_db, inner_root, outer_db = outer_db, outer_root, 2.0 * outer_db
        if outer_db > LONGEST_SEARCH_DB:
            return None
    for _ in range(MOST_BOUND_STEPS):
        trial_db = inner_db + (outer_db - inner_db) * (target_root - inner_root) / (outer_root - inner_root)
        if abs((trial_root := compute_root(trial_db)) - target_root) < BOUND_ROOT_TOLERANCE:
            return float(fit.parameters[index] - trial_db)
        if trial_root < target_root:
            inner_db, inner_root = trial_db, trial_root
        else:
            outer_db, outer_root = trial_db, trial_root
    return float(fit.parameters[index] - outer_db)


def estimate_direction_limit(
    frequencies_hz: tuple[float, ...],
    pseudo_thresholds_db: FloatArray,
    cap_db: float,
    confidence: float,
    has_answers: NDArray[np.bool_] | None = None,
    above_cap_hz: Sequence[float] = (),
) -> DirectionLimit:
    """Estimate the direction limit from pseudo-thresholds (n, k), interpolated linearly over the log of the frequency
    at 2001 points (chosen: steps below 0.1 % from 15 to 60 Hz). Its interval goes from the lowest to the highest
    frequency at which the interval of the median contains the cap. has_answers: (n, k), see `compute_mean_errors`;
    None: all. above_cap_hz: frequencies whose profile bound is above the cap, where intervals by influence functions
    are too wide; the limit is excluded from each of them up to the next frequency with an estimate below the cap."""
    grid_hz = np.geomspace(frequencies_hz[0], frequencies_hz[-1], 2001)
    weights = np.array([np.interp(np.log(grid_hz), np.log(frequencies_hz), row) for row in np.eye(len(frequencies_hz))])
    interpolated_db = pseudo_thresholds_db @ weights
    median_db = interpolated_db.mean(axis=0)
    without_answers = np.zeros(pseudo_thresholds_db.shape) if has_answers is None else (~has_answers).astype(np.float64)
    errors = compute_mean_errors(interpolated_db, without_answers @ (weights > 0) == 0)
    half_width = student_t.ppf(0.5 + confidence / 2, errors.df) * errors.error
    crossings = np.flatnonzero((median_db[:-1] < cap_db) & (median_db[1:] >= cap_db))
    contains_cap = (median_db - half_width <= cap_db) & (median_db + half_width >= cap_db)
    grid_indices = [int(np.abs(grid_hz - frequency_hz).argmin()) for frequency_hz in frequencies_hz]
    below_cap_indices = [grid_index for grid_index in grid_indices if median_db[grid_index] < cap_db]
    for grid_index, frequency_hz in zip(grid_indices, frequencies_hz, strict=True):
        if frequency_hz in above_cap_hz:
            contains_cap[
                grid_index : next((below_index for below_index in below_cap_indices if below_index > grid_index), None)
            ] = False
    # An interval narrower than a step of the grid may contain none of its frequencies; the frequencies on either side
    # of a crossing always count.
    contains_cap[crossings] = contains_cap[crossings + 1] = True
    cap_indices = np.flatnonzero(contains_cap)
    lower_hz = float(grid_hz[cap_indices[0]]) if len(cap_indices) and cap_indices[0] > 0 else None
    upper_hz = float(grid_hz[cap_indices[-1]]) if len(cap_indices) and cap_indices[-1] < len(grid_hz) - 1 else None
    if len(crossings) != 1 or median_db[0] >= cap_db:
        return DirectionLimit(
            None, lower_hz, upper_hz, _explain_no_limit(median_db, cap_db, len(crossings), frequencies_hz)
        )
    crossing = crossings[0]
    fraction = (cap_db - median_db[crossing]) / (median_db[crossing + 1] - median_db[crossing])
    limit_hz = float(grid_hz[crossing] * (grid_hz[crossing + 1] / grid_hz[crossing]) ** fraction)
    return DirectionLimit(
        limit_hz, lower_hz, upper_hz, _describe_recrossing(median_db, crossing, cap_db, grid_hz) + _LIMIT_WORDS
    )


_LIMIT_WORDS = (
    "A limit of this device, this cap and this task: a stronger device, another grip or another task has another. "
    "Nothing is extrapolated beyond the frequencies played."
)
"""Sentences on the scope of a limit, appended to `DirectionLimit.words`."""


def _describe_recrossing(median_db: FloatArray, crossing: np.intp, cap_db: float, grid_hz: FloatArray) -> str:
    """Describe in a sentence from where on the median threshold is below the cap again, above the limit; empty where it
    stays at or above it. crossing: index of the grid's last point before the limit."""
    below_cap_indices = np.flatnonzero(median_db[crossing + 1 :] < cap_db)
    if not len(below_cap_indices):
        return ""
    return f"From {grid_hz[crossing + 1 + below_cap_indices[0]]:.1f} Hz the median threshold is below the cap again. "


def _explain_no_limit(
    median_db: FloatArray, cap_db: float, crossing_count: int, frequencies_hz: tuple[float, ...]
) -> str:
    """Explain in sentences why there is no single limit. crossing_count: number of upward crossings of the cap."""
    if crossing_count > 1:
        reason = f"The median threshold rises through the cap {crossing_count} times."
    elif median_db[0] >= cap_db:
        reason = f"The median threshold is above the cap already at {frequencies_hz[0]:g} Hz."
    else:
        reason = f"The median threshold stays below the cap up to {frequencies_hz[-1]:g} Hz, the highest played."
    return f"{reason} {_LIMIT_WORDS}"
