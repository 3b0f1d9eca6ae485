"""Maximum-likelihood threshold of each single run, with a likelihood interval.

One run of some 60 trials does not determine a slope. The likelihood of the threshold is therefore averaged over a
distribution of slope, criterion and lapse rate (`Nuisance`), from the model of all answers or from usual values. No
prior of the threshold enters: estimate and interval rest on the run's answers alone, without shrinkage.

After right answers only, the likelihood rises towards low thresholds without a maximum: there is no estimate, only an
upper bound. Where the estimate is above the cap there is only a lower bound. Each bound is that end of the two-sided
interval: because the answers decide what is reported, a one-sided bound at the same confidence would hold too rarely
(G. J. Feldman, R. D. Cousins, Phys. Rev. D 57 (1998), 3873-3889).

Source: S. S. Wilks, Ann. Math. Stat. 9 (1938), 60-62 (half the chi-squared quantile below the highest log-likelihood).
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.special import logsumexp
from scipy.stats import chi2

from analysis.psychophysics.hierarchy.answers import Answers
from analysis.psychophysics.hierarchy.curve import AT_THRESHOLD, NEPER_PER_DB, Family, sensitivity, share_right
from equalizer.signals.signal import FloatArray

GRID_DB, BEYOND_DB = 0.1, 30.0
"""Step of the grid of thresholds (dB), and its reach below the lowest level and above the highest level or the cap."""
NODES = 7
"""Nodes of the Gauss-Hermite rule that averages over slopes, or over criteria."""
SAME_HEIGHT = 1e-9
"""Log-likelihoods closer than this differ by rounding alone."""


@dataclass(frozen=True, slots=True)
class Nuisance:
    """Parameters that a run itself does not determine: distributions of slope, criterion and lapse rate."""

    slope: float
    """Median slope, in the units of `curve`."""
    criterion: float
    """Mean criterion, in units of d'."""
    lapses: tuple[float, ...]
    """Equally probable lapse rates."""
    slope_log_sd: float = 0.0
    criterion_sd: float = 0.0
    """Standard deviations of normal distributions around the slope's logarithm and the criterion; 0: known exactly."""


@dataclass(frozen=True, slots=True)
class RunLikelihood:
    """Threshold of one person at one frequency by those answers alone, in dB re 1 N. The interval holds all thresholds
    whose log-likelihood is within half the chi-squared quantile (1 degree of freedom) of the maximum."""

    subject: str
    frequency_hz: float
    trials: int
    """Number of answers, of all runs of the person at this frequency together."""
    db: float | None
    """Maximum-likelihood estimate. None where it is above the cap: `lower_db` is then a one-sided bound. Also None
    where `below` is True: `upper_db` is then a one-sided bound."""
    lower_db: float | None
    """Lower end; None: no lower end within `BEYOND_DB` below the levels played."""
    upper_db: float | None
    """Upper end; None: the answers do not contradict a participant who feels no direction at all, or `db` is None
    because it is above the cap."""
    below: bool
    """True where the likelihood is highest at the lower end of the grid, as after right answers only."""


def run_likelihoods(
    answers: Answers,
    people: Sequence[Nuisance],
    cap_db: float,
    family: Family = Family.WEIBULL,
    confidence: float = 0.95,
) -> tuple[RunLikelihood, ...]:
    """Threshold and interval of each person at each frequency with answers, in the order of the runs' indices. people:
    an entry per subject of the answers. cap_db: cap in dB re 1 N. confidence: of the two-sided interval."""
    k = len(answers.frequencies_hz)
    found = []
    for run in np.unique(answers.run):
        person, place = divmod(int(run), k)
        grid, height = _likelihood(answers, int(run), people[person], cap_db, family)
        trials = int((answers.right + answers.wrong)[answers.run == run].sum())
        ends = _profile_interval(grid, height, cap_db, confidence)
        found.append(RunLikelihood(answers.subjects[person], answers.frequencies_hz[place], trials, *ends))
    return tuple(found)


def _likelihood(
    answers: Answers, run: int, person: Nuisance, cap_db: float, family: Family
) -> tuple[FloatArray, FloatArray]:
    """Grid of thresholds (g,) in dB, and the logarithm of the likelihood at each, averaged over slope, criterion and
    lapse rate."""
    cells = answers.run == run
    level, side = answers.level_db[cells], answers.side[cells]
    grid = np.arange(level.min() - BEYOND_DB, max(level.max(), cap_db) + BEYOND_DB, GRID_DB)
    heights, weights = [], []
    for u, by_slope in _nodes(person.slope_log_sd):
        t = AT_THRESHOLD[family] + person.slope * math.exp(u) * NEPER_PER_DB * (level[None, :] - grid[:, None])
        q = sensitivity(t, family)[0]
        for c, by_criterion in _nodes(person.criterion_sd):
            for lapse in person.lapses:
                p = share_right(q - side * (person.criterion + c), lapse)
                heights.append(np.log(p) @ answers.right[cells] + np.log1p(-p) @ answers.wrong[cells])
                weights.append(by_slope * by_criterion / len(person.lapses))
    return grid, logsumexp(heights, axis=0, b=np.array(weights)[:, None])


def _nodes(sd: float) -> list[tuple[float, float]]:
    """Positions and weights of Gauss-Hermite quadrature for a normal distribution with mean 0 and this sd."""
    if sd == 0.0:
        return [(0.0, 1.0)]
    places, weights = np.polynomial.hermite_e.hermegauss(NODES)
    return list(zip(sd * places, weights / weights.sum(), strict=True))


def _profile_interval(
    grid: FloatArray, height: FloatArray, cap_db: float, confidence: float
) -> tuple[float | None, float | None, float | None, bool]:
    """Estimate, lower end, upper end, and whether the maximum is at the lower end of the grid (`RunLikelihood`). grid,
    height: (g,)."""
    best = float(grid[height.argmax()])
    below, above = bool(height[0] >= height.max() - SAME_HEIGHT), best > cap_db
    inside = np.flatnonzero(height >= height.max() - chi2.ppf(confidence, 1) / 2)
    lower = float(grid[inside[0]]) if inside[0] > 0 else None
    upper = float(grid[inside[-1]]) if inside[-1] < len(grid) - 1 else None
    if below:
        return None, None, upper, True
    return (None, lower, None, False) if above else (best, lower, upper, False)


def newton_or_none(db: float | None) -> float | None:
    """Newtons from a level in dB re 1 N; None for None."""
    return None if db is None else math.pow(10.0, db / 20.0)
