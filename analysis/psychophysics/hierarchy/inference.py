"""Inference from the hierarchical fit: persons are the sampling units and carry the uncertainty.

Each person's influence on the means is n A^-1 s_i, with A the curvature of the fit and s_i the person's score. Mean
plus influence is a person's pseudo-threshold in dB: with the thresholds known exactly it would be the threshold itself,
and what follows the textbook's analysis within participants. Its standard errors are the cluster-robust ones (sandwich)
with n / (n - 1), so unequal spreads and a family that does not fit widen the intervals as they should.

Source: K.-Y. Liang, S. L. Zeger, Biometrika 73 (1986), 13-22; G. Kauermann, R. J. Carroll, J. Am. Stat. Assoc. 96
(2001), 1387-1396 (few clusters, t with n - 1 degrees of freedom).
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.stats import t as student

from analysis.psychophysics.group_contrasts import mean_errors
from analysis.psychophysics.hierarchy.fit import HierarchicalFit
from analysis.psychophysics.hierarchy.objective import Objective, Prior
from analysis.psychophysics.hierarchy.refine import Refinement
from equalizer.signals.signal import FloatArray

BOUND_ROOT, BOUND_STEPS = 0.03, 8
"""A bound is found when its likelihood root, some 2.3, is met this closely: 97.5 % is then 97.4 to 97.6 %. The steps
end a search on a likelihood that is no line at all, on the safe side."""
FAR_DB = 32.0
"""Farthest search for a bound below the estimate, in dB."""


FEWEST_PEOPLE = 3
"""Fewest participants for a confidence interval of a mean over people."""


@dataclass(frozen=True, slots=True)
class MedianThreshold:
    """The median participant's threshold at one frequency, in dB re 1 N."""

    frequency_hz: float
    db: float
    lower_db: float | None
    """Lower bound; None: the answers do not contradict a median `FAR_DB` below the estimate, or they come from too few
    people (below the cap from two, above it from one)."""
    upper_db: float | None
    """None where the median is above the cap: then lower_db is a one-sided bound, and no size is known. None, too,
    where two people or fewer have enough answers."""
    above_cap: bool

    @property
    def newton(self) -> float:
        """The estimate in N."""
        return float(10.0 ** (self.db / 20.0))

    @property
    def lower_n(self) -> float | None:
        return None if self.lower_db is None else float(10.0 ** (self.lower_db / 20.0))

    @property
    def upper_n(self) -> float | None:
        return None if self.upper_db is None else float(10.0 ** (self.upper_db / 20.0))


@dataclass(frozen=True, slots=True)
class DirectionLimit:
    """Frequency at which the median participant's threshold reaches the cap."""

    frequency_hz: float | None
    """The frequency; None where it lies outside the range that was played, or is reached from below more than once."""
    lower_hz: float | None
    """Lower bound; None: below the lowest frequency played."""
    upper_hz: float | None
    """Upper bound; None: above the highest frequency played."""
    words: str


def pseudo_thresholds(fit: HierarchicalFit) -> FloatArray:
    """Pseudo-thresholds (n, k) in dB, by influence functions: their mean is the estimate, their spread its
    uncertainty."""
    centred = fit.scores - fit.scores.mean(axis=0)
    influence = fit.answers.persons * np.linalg.solve(fit.curvature, centred.T).T
    pseudo: FloatArray = fit.means_db + influence[:, : fit.layout.k]
    return pseudo


def median_thresholds(
    fit: HierarchicalFit, cap_db: float, confidence: float, prior: Prior | None = None
) -> tuple[MedianThreshold, ...]:
    """Two-sided intervals below the cap, one-sided profile bounds above it, each the lower end that a two-sided
    interval of the confidence has: the data choose which of them is reported (see `lower_bound`). With two people at a
    frequency there is no interval: a t distribution with one degree of freedom holds nearly every threshold."""
    errors = mean_errors(pseudo_thresholds(fit), fit.answers.played)
    half = student.ppf(0.5 + confidence / 2, errors.df) * errors.error
    medians = []
    for place, frequency_hz in enumerate(fit.answers.frequencies_hz):
        db, people, df = float(fit.means_db[place]), int(errors.people[place]), float(errors.df[place])
        ends: tuple[float | None, float | None] = None, None
        if db > cap_db and people > 1:
            ends = lower_bound(fit, place, 0.5 + confidence / 2, prior or Prior(), df), None
        elif db <= cap_db and people >= FEWEST_PEOPLE:
            ends = db - float(half[place]), db + float(half[place])
        medians.append(MedianThreshold(frequency_hz, db, *ends, db > cap_db))
    return tuple(medians)


def lower_bound(
    fit: HierarchicalFit, place: int, confidence: float, prior: Prior, df: float | None = None
) -> float | None:
    """One-sided bound of a mean by profile likelihood, with the t distribution's quantile in place of the normal's.

    A bound that is only reported where the estimate is above the cap is wrong more often than its confidence says,
    where the true median is near the cap: then each of the two ends may be wrong by half of what is left, and no more.
    Source: G. J. Feldman, R. D. Cousins, Phys. Rev. D 57 (1998), 3873-3889.

    df: degrees of freedom, None for those of all persons. None where no bound is found within `FAR_DB` below the
    estimate.
    """
    search = Refinement(Objective(fit.answers, fit.family, prior))
    best = search.lowest_cost(fit.parameters)
    wanted = float(student.ppf(confidence, fit.answers.persons - 1 if df is None else df))
    unit = np.eye(len(fit.parameters))[place]
    along = np.linalg.solve(fit.curvature, unit)
    along = along / along[place]

    def root(below_db: float) -> float:
        """Signed root of the likelihood ratio: of a quadratic likelihood, a straight line."""
        # The other parameters begin where a quadratic likelihood would have them; where that ends too low to go on,
        # also where they are at the estimate, for with few answers the cost has several minima, and a profile is the
        # lowest of them.
        cost = search.lowest_cost(fit.parameters - below_db * along, held=place)
        if math.sqrt(max(0.0, 2.0 * (cost - best))) >= wanted:
            cost = min(cost, search.lowest_cost(fit.parameters - below_db * unit, held=place))
        return math.sqrt(max(0.0, 2.0 * (cost - best)))

    near, near_root, far = 0.0, 0.0, 2.0
    while (far_root := root(far)) < wanted:
        near, near_root, far = far, far_root, 2.0 * far
        if far > FAR_DB:
            return None
    for _ in range(BOUND_STEPS):
        middle = near + (far - near) * (wanted - near_root) / (far_root - near_root)
        if abs((middle_root := root(middle)) - wanted) < BOUND_ROOT:
            return float(fit.parameters[place] - middle)
        if middle_root < wanted:
            near, near_root = middle, middle_root
        else:
            far, far_root = middle, middle_root
    return float(fit.parameters[place] - far)


def direction_limit(
    frequencies_hz: tuple[float, ...],
    pseudo: FloatArray,
    cap_db: float,
    confidence: float,
    known: NDArray[np.bool_] | None = None,
    shown_above: Sequence[float] = (),
) -> DirectionLimit:
    """Estimate the direction limit from pseudo-thresholds (n, k). Between the frequencies played: straight lines over
    the logarithm of frequency. The interval holds every frequency whose median threshold may be the cap: its own
    interval contains the cap. known: (n, k), see `mean_errors`; None: all. shown_above: frequencies whose median has a
    profile bound above the cap: there an interval by influence functions is as wide as the model's extrapolation. From
    such a frequency on the limit cannot lie, up to the next whose estimate is below the cap."""
    grid = np.geomspace(frequencies_hz[0], frequencies_hz[-1], 2001)
    weights = np.array([np.interp(np.log(grid), np.log(frequencies_hz), row) for row in np.eye(len(frequencies_hz))])
    lines = pseudo @ weights
    middle = lines.mean(axis=0)
    unknown = np.zeros(pseudo.shape) if known is None else (~known).astype(np.float64)
    errors = mean_errors(lines, unknown @ (weights > 0) == 0)
    half = student.ppf(0.5 + confidence / 2, errors.df) * errors.error
    crossings = np.flatnonzero((middle[:-1] < cap_db) & (middle[1:] >= cap_db))
    may_be = (middle - half <= cap_db) & (middle + half >= cap_db)
    places = [int(np.abs(grid - frequency_hz).argmin()) for frequency_hz in frequencies_hz]
    below = [place for place in places if middle[place] < cap_db]
    for place, frequency_hz in zip(places, frequencies_hz, strict=True):
        if frequency_hz in shown_above:
            may_be[place : next((other for other in below if other > place), None)] = False
    # The frequencies of the grid may all miss an interval that is narrower than their distance: the limit lies between
    # that before the crossing and the next.
    may_be[crossings] = may_be[crossings + 1] = True
    possible = np.flatnonzero(may_be)
    lower = float(grid[possible[0]]) if len(possible) and possible[0] > 0 else None
    upper = float(grid[possible[-1]]) if len(possible) and possible[-1] < len(grid) - 1 else None
    if len(crossings) != 1 or middle[0] >= cap_db:
        return DirectionLimit(None, lower, upper, _no_limit(middle, cap_db, len(crossings), frequencies_hz))
    at = crossings[0]
    share = (cap_db - middle[at]) / (middle[at + 1] - middle[at])
    frequency = float(grid[at] * (grid[at + 1] / grid[at]) ** share)
    return DirectionLimit(frequency, lower, upper, _back_below(middle, at, cap_db, grid) + _LIMIT_WORDS)


_LIMIT_WORDS = (
    "A limit of this device, this cap and this task: a stronger device, another grip or another task has another. "
    "Nothing is extrapolated beyond the frequencies played."
)


def _back_below(middle: FloatArray, at: np.intp, cap_db: float, grid: FloatArray) -> str:
    """Above the limit the directions may be felt again; empty where they are not."""
    below = np.flatnonzero(middle[at + 1 :] < cap_db)
    if not len(below):
        return ""
    return f"From {grid[at + 1 + below[0]]:.1f} Hz the median threshold is below the cap again. "


def _no_limit(middle: FloatArray, cap_db: float, crossings: int, frequencies_hz: tuple[float, ...]) -> str:
    if crossings > 1:
        reason = f"The median threshold crosses the cap {crossings} times."
    elif middle[0] >= cap_db:
        reason = f"The median threshold is above the cap already at {frequencies_hz[0]:g} Hz."
    else:
        reason = f"The median threshold stays below the cap up to {frequencies_hz[-1]:g} Hz, the highest played."
    return f"{reason} {_LIMIT_WORDS}"
