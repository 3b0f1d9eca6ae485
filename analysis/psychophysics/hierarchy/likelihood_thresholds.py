"""Maximum-likelihood threshold of each participant at each frequency, with a likelihood interval.

The answers of all runs of a participant at a frequency are pooled; most have one run there. Some 60 trials do not
determine a slope. The likelihood of the threshold is therefore averaged over a distribution of slope, criterion and
lapse rate (`Nuisance`), from the model of all answers or from usual values. The threshold has no prior: it is not
shrunk towards other thresholds.

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
from analysis.psychophysics.hierarchy.curve import (
    NEPER_PER_DB,
    T_AT_THRESHOLD,
    Family,
    compute_proportion_correct,
    differentiate_evidence,
)
from equalizer.signals.signal import FloatArray

GRID_STEP_DB, GRID_MARGIN_DB = 0.1, 30.0
"""Step of the grid of thresholds (dB), and its reach below the lowest level and above the highest level or the cap.
Both chosen: the step is far below the width of an interval."""
QUADRATURE_NODES = 7
"""Number of nodes of the Gauss-Hermite quadrature over slopes, and of that over criteria. Chosen."""
EQUAL_LOG_LIKELIHOOD = 1e-9
"""Difference of log-likelihoods below which they count as equal. Chosen."""


@dataclass(frozen=True, slots=True)
class Nuisance:
    """Nuisance parameters, which the answers at a frequency do not determine: distributions of slope, criterion and
    lapse rate."""

    slope: float
    """Median slope, in the units of `curve`."""
    criterion: float
    """Mean criterion, in units of d'."""
    lapses: tuple[float, ...]
    """Equally probable lapse rates."""
    slope_log_sd: float = 0.0
    """Standard deviation of a normal distribution of the slope's natural logarithm; 0: the slope is known exactly."""
    criterion_sd: float = 0.0
    """Standard deviation of a normal distribution of the criterion; 0: the criterion is known exactly."""


@dataclass(frozen=True, slots=True)
class LikelihoodThreshold:
    """Threshold of a participant at a frequency by the answers of all runs there, in dB re 1 N; the names of the fields
    are those of the entries of `anova.json`. The interval: from the lowest to
    the highest threshold whose log-likelihood is within half the chi-squared quantile (1 df) of the maximum."""

    subject: str
    frequency_hz: float
    trials: int
    """Number of answers, of all runs of the participant at this frequency together."""
    db: float | None
    """Maximum-likelihood estimate of the threshold. None where it is above the cap: only the lower bound `lower_db` is
    then reported. Also None where `below` is True: only the upper bound `upper_db` is then reported."""
    lower_db: float | None
    """Lower end; None: no lower end within `GRID_MARGIN_DB` below the levels played."""
    upper_db: float | None
    """Upper end; None: the answers do not contradict a participant who feels no direction at all, or `db` is None
    because it is above the cap."""
    below: bool
    """Whether the threshold lies below the levels played: True where the likelihood is highest at the lower end of the
    grid, as after right answers only."""


def compute_likelihood_thresholds(
    answers: Answers,
    nuisances: Sequence[Nuisance],
    cap_db: float,
    family: Family = Family.WEIBULL,
    confidence: float = 0.95,
) -> tuple[LikelihoodThreshold, ...]:
    """Compute threshold and interval of each participant at each frequency with answers, in the order of `Answers.run`.
    nuisances: an entry per subject of the answers. cap_db: cap in dB re 1 N. confidence: of the two-sided interval."""
    frequency_count = len(answers.frequencies_hz)
    run_estimates = []
    for run_index in np.unique(answers.run):
        person_index, frequency_index = divmod(int(run_index), frequency_count)
        grid_db, log_likelihood = _compute_likelihood_on_grid(
            answers, int(run_index), nuisances[person_index], cap_db, family
        )
        answer_count = int((answers.right + answers.wrong)[answers.run == run_index].sum())
        estimate_and_ends = _find_likelihood_interval(grid_db, log_likelihood, cap_db, confidence)
        run_estimates.append(
            LikelihoodThreshold(
                answers.subjects[person_index],
                answers.frequencies_hz[frequency_index],
                answer_count,
                *estimate_and_ends,
            )
        )
    return tuple(run_estimates)


def _compute_likelihood_on_grid(
    answers: Answers, run_index: int, nuisance: Nuisance, cap_db: float, family: Family
) -> tuple[FloatArray, FloatArray]:
    """Compute a grid of thresholds (g,) in dB, and the logarithm of the likelihood at each, averaged over slope,
    criterion and lapse rate."""
    is_in_run = answers.run == run_index
    level_db, side = answers.level_db[is_in_run], answers.side[is_in_run]
    grid_db = np.arange(level_db.min() - GRID_MARGIN_DB, max(level_db.max(), cap_db) + GRID_MARGIN_DB, GRID_STEP_DB)
    log_likelihoods, weights = [], []
    for u, slope_weight in _make_gauss_hermite_nodes(nuisance.slope_log_sd):
        t = T_AT_THRESHOLD[family] + nuisance.slope * math.exp(u) * NEPER_PER_DB * (
            level_db[None, :] - grid_db[:, None]
        )
        q = differentiate_evidence(t, family)[0]
        for c, criterion_weight in _make_gauss_hermite_nodes(nuisance.criterion_sd):
            for lapse in nuisance.lapses:
                p = compute_proportion_correct(q - side * (nuisance.criterion + c), lapse)
                log_likelihoods.append(np.log(p) @ answers.right[is_in_run] + np.log1p(-p) @ answers.wrong[is_in_run])
                weights.append(slope_weight * criterion_weight / len(nuisance.lapses))
    return grid_db, logsumexp(log_likelihoods, axis=0, b=np.array(weights)[:, None])


def _make_gauss_hermite_nodes(sd: float) -> list[tuple[float, float]]:
    """Make positions and weights (of sum 1) of Gauss-Hermite quadrature for a normal distribution with mean 0 and this
    sd; a single node at 0 where it is 0."""
    if sd == 0.0:
        return [(0.0, 1.0)]
    positions, weights = np.polynomial.hermite_e.hermegauss(QUADRATURE_NODES)
    return list(zip(sd * positions, weights / weights.sum(), strict=True))


def _find_likelihood_interval(
    grid_db: FloatArray, log_likelihood: FloatArray, cap_db: float, confidence: float
) -> tuple[float | None, float | None, float | None, bool]:
    """Find estimate, lower end, upper end (dB), and whether the maximum is at the lower end of the grid
    (`LikelihoodThreshold`). grid_db, log_likelihood: (g,)."""
    best_db = float(grid_db[log_likelihood.argmax()])
    is_highest_at_low_end, is_above_cap = (
        bool(log_likelihood[0] >= log_likelihood.max() - EQUAL_LOG_LIKELIHOOD),
        best_db > cap_db,
    )
    interval_indices = np.flatnonzero(log_likelihood >= log_likelihood.max() - chi2.ppf(confidence, 1) / 2)
    lower_db = float(grid_db[interval_indices[0]]) if interval_indices[0] > 0 else None
    upper_db = float(grid_db[interval_indices[-1]]) if interval_indices[-1] < len(grid_db) - 1 else None
    if is_highest_at_low_end:
        return None, None, upper_db, True
    return (None, lower_db, None, False) if is_above_cap else (best_db, lower_db, upper_db, False)


def convert_to_newton(db: float | None) -> float | None:
    """Convert a level in dB re 1 N to newtons; None for None."""
    return None if db is None else math.pow(10.0, db / 20.0)
