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
from scipy.stats import t as student

from analysis.psychophysics.group_contrasts import mean_errors
from analysis.psychophysics.hierarchy.fit import HierarchicalFit
from analysis.psychophysics.hierarchy.objective import Objective, Prior
from analysis.psychophysics.hierarchy.refine import Refinement
from equalizer.signals.signal import FloatArray

BOUND_ROOT, BOUND_STEPS = 0.03, 8
"""Tolerance of the signed root of the likelihood ratio at a bound, whose target is about 2.3 (97.5 % becomes 97.4 to
97.6 %), and largest number of steps. A search that uses all steps returns the farther, conservative, end."""
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
    """Lower bound; None: the answers do not contradict a median `FAR_DB` below the estimate, or too few people have
    enough answers (two or fewer for a median below the cap, one or none for a median above it)."""
    upper_db: float | None
    """Upper bound; None where the median is above the cap: lower_db is then a one-sided bound, and the estimate itself
    is an extrapolation. Also None where two people or fewer have enough answers."""
    above_cap: bool
    """Whether the estimate is above the cap."""

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
    """None where the median is above the cap from the lowest frequency on, never reaches it, or crosses it upwards more
    than once."""
    lower_hz: float | None
    """Lower bound; None: below the lowest frequency played."""
    upper_hz: float | None
    """Upper bound; None: above the highest frequency played."""
    words: str
    """Sentences on the limit and its scope, for reports."""


def pseudo_thresholds(fit: HierarchicalFit) -> FloatArray:
    """Pseudo-thresholds (n, k) in dB, by influence functions: their mean is the estimate of the median threshold, their
    standard deviation over sqrt(n) its standard error."""
    centred = fit.scores - fit.scores.mean(axis=0)
    influence = fit.answers.persons * np.linalg.solve(fit.curvature, centred.T).T
    pseudo: FloatArray = fit.means_db + influence[:, : fit.layout.k]
    return pseudo


def median_thresholds(
    fit: HierarchicalFit, cap_db: float, confidence: float, prior: Prior | None = None
) -> tuple[MedianThreshold, ...]:
    """Median threshold at each frequency. Below the cap: two-sided t interval over pseudo-thresholds. Above it: profile
    bound at the level of the lower end of a two-sided interval (see `lower_bound`). With two people at a frequency
    there is no interval below the cap: with one degree of freedom it would contain nearly every threshold."""
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
    """Lower bound in dB of the mean of index `place` by profile likelihood, with the quantile of the t distribution in
    place of the normal one. confidence: one-sided.

    A caller that reports the bound only where the estimate is above the cap must pass (1 + c) / 2 for an interval of
    confidence c: choosing between interval and bound by the data costs coverage near the cap.
    Source: G. J. Feldman, R. D. Cousins, Phys. Rev. D 57 (1998), 3873-3889.

    df: degrees of freedom; None: n - 1 of all persons. Returns None where no bound is found within `FAR_DB` below the
    estimate.
    """
    search = Refinement(Objective(fit.answers, fit.family, prior))
    best = search.lowest_cost(fit.parameters)
    wanted = float(student.ppf(confidence, fit.answers.persons - 1 if df is None else df))
    unit = np.eye(len(fit.parameters))[place]
    along = np.linalg.solve(fit.curvature, unit)
    along = along / along[place]

    def root(below_db: float) -> float:
        """Root of the likelihood ratio with the mean held below_db lower; linear if the log-likelihood is quadratic."""
        # The other parameters start where a quadratic likelihood has them. With few answers the cost has several
        # minima: where the root reaches its target, a second search starts with the others at the estimate.
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
    """Estimate the direction limit from pseudo-thresholds (n, k), interpolated linearly over the log of the frequency.
    Its interval goes from the lowest to the highest frequency at which the interval of the median contains the cap.
    known: (n, k), see `mean_errors`; None: all. shown_above: frequencies whose profile bound is above the cap, where
    intervals by influence functions are too wide; the limit is excluded from each of them up to the next frequency with
    an estimate below the cap."""
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
    # An interval narrower than a step of the grid may contain none of its frequencies; the frequencies on either side
    # of a crossing always count.
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
    """Sentence where the median threshold falls below the cap again above the limit; empty where it does not."""
    below = np.flatnonzero(middle[at + 1 :] < cap_db)
    if not len(below):
        return ""
    return f"From {grid[at + 1 + below[0]]:.1f} Hz the median threshold is below the cap again. "


def _no_limit(middle: FloatArray, cap_db: float, crossings: int, frequencies_hz: tuple[float, ...]) -> str:
    """Sentences on why there is no single limit."""
    if crossings > 1:
        reason = f"The median threshold crosses the cap {crossings} times."
    elif middle[0] >= cap_db:
        reason = f"The median threshold is above the cap already at {frequencies_hz[0]:g} Hz."
    else:
        reason = f"The median threshold stays below the cap up to {frequencies_hz[-1]:g} Hz, the highest played."
    return f"{reason} {_LIMIT_WORDS}"
