"""Power, type-1 error, coverage and bias of a planned study, by analysis and sample size, from simulated studies.

Each simulated study is tested at one pair of frequencies at the 5 % level by three analyses: the hierarchical model
(t test over pseudo-thresholds), means of runs in dB (paired t test), and the published procedure (Tukey's test in
newtons: |difference| > q sqrt(MS_within / n)). Power is the share of studies that find the difference; without a true
difference this share is the type-1 error.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache

import numpy as np
from scipy.stats import studentized_range

from analysis.psychophysics.anova import compute_one_way_anova
from analysis.psychophysics.catch_trials import compute_wilson_interval
from analysis.psychophysics.group_contrasts import compute_pair_contrast
from analysis.psychophysics.hierarchy.fit import fit_hierarchy
from analysis.psychophysics.hierarchy.primary import compare_pair
from analysis.psychophysics.power.simulated_study import Crowd, simulate_study
from protocols.definition.staircase_rule import StaircaseRule
from protocols.procedure.staircase import to_db

CONFIDENCE = 0.95
"""Confidence of the contrasts' intervals; every test has the level 1 - CONFIDENCE."""


@dataclass(frozen=True, slots=True)
class StudyVerdict:
    """Verdicts and errors of the three analyses on one simulated study, for one pair of frequencies, at the 5 %
    level."""

    people: int
    trials: int
    """Number of trials of all people together."""
    primary_found: bool
    """Whether the hierarchical model of all answers finds the difference, by a t test over people. False where no test
    is possible, because the differences of all people are equal or, by the model, both medians are far above the cap
    (`hierarchy.primary.FAR_ABOVE_DB`); also in `primary_covers` and `means_found`."""
    primary_covers: bool
    """Whether the model's 95 % interval contains the true difference."""
    primary_error_db: float
    """Estimated minus true difference, by the model."""
    means_found: bool
    """Whether a paired t test of reversal means in dB (Psi: posterior means) finds the difference."""
    means_error_db: float
    """Estimated minus true difference, by these means; NaN where a run of the study, at any frequency, did not end, so
    that its means and the published analysis have no result."""
    published_found: bool
    """Whether Tukey's test after a one-way ANOVA of means in newtons finds the difference."""


@dataclass(frozen=True, slots=True)
class Share:
    """A share of the simulated studies with its interval."""

    value: float
    """Share, 0 to 1."""
    lower: float
    upper: float
    """Limits of Wilson's 95 % interval, due to the limited number of simulated studies."""


@dataclass(frozen=True, slots=True)
class PowerPoint:
    """Power, coverage and bias of studies with a given number of people, by analysis: the primary (hierarchical)
    analysis, means of runs, and the published procedure."""

    people: int
    studies: int
    trials_per_person: float
    primary: Share
    means: Share
    published: Share
    """Share of studies in which each analysis finds the difference; without a true difference, the type-1 error."""
    coverage: Share
    """Coverage of the primary analysis's 95 % interval."""
    primary_bias_db: float
    means_bias_db: float
    """Mean error of the estimated difference, dB."""


def judge_study(
    crowd: Crowd, rule: StaircaseRule, people: int, seed: tuple[int, ...], contrast_hz: tuple[float, ...] = ()
) -> StudyVerdict:
    """Simulate a study and test it. people: number of participants, at least two. rule: without a trial limit, because
    all runs must have a threshold. seed: entropy of all random draws. contrast_hz: as for `find_judged_pair`."""
    study = simulate_study(crowd, rule, people, seed)
    pair_hz = find_judged_pair(crowd.frequencies_hz, contrast_hz)
    first_column, second_column = (crowd.frequencies_hz.index(frequency_hz) for frequency_hz in pair_hz)
    true_difference_db = compute_true_difference_db(crowd, contrast_hz)
    fit = fit_hierarchy(study.answers)
    primary_contrast = compare_pair(fit, pair_hz, to_db(rule.cap_n), CONFIDENCE)
    means_contrast = compute_pair_contrast(crowd.frequencies_hz, study.threshold_db, pair_hz, CONFIDENCE)
    group_names = [f"{group_hz:g} Hz" for group_hz in crowd.frequencies_hz]
    anova = compute_one_way_anova(
        {name: list(column) for name, column in zip(group_names, study.threshold_n.T, strict=True)}
    )
    difference_n = abs(float((study.threshold_n[:, first_column] - study.threshold_n[:, second_column]).mean()))
    critical_difference_n = _compute_critical_range(len(group_names), anova.df_within or 1) * math.sqrt(
        (anova.mean_square_within or math.inf) / people
    )
    return StudyVerdict(
        people=people,
        trials=study.trials,
        primary_found=primary_contrast is not None and primary_contrast.p < 1.0 - CONFIDENCE,
        primary_covers=primary_contrast is not None
        and primary_contrast.lower_db <= true_difference_db <= primary_contrast.upper_db,
        primary_error_db=float(fit.means_db[first_column] - fit.means_db[second_column]) - true_difference_db,
        means_found=means_contrast is not None and means_contrast.p < 1.0 - CONFIDENCE,
        means_error_db=math.nan
        if np.isnan(study.threshold_db).any()
        else float((study.threshold_db[:, first_column] - study.threshold_db[:, second_column]).mean())
        - true_difference_db,
        published_found=difference_n > critical_difference_n,
    )


def find_judged_pair(frequencies_hz: tuple[float, ...], contrast_hz: tuple[float, ...]) -> tuple[float, float]:
    """Choose the pair to test, first minus second: the declared contrast, or without one the highest frequency minus
    the lowest. frequencies_hz: in ascending order."""
    return (contrast_hz[0], contrast_hz[1]) if contrast_hz else (frequencies_hz[-1], frequencies_hz[0])


def compute_true_difference_db(crowd: Crowd, contrast_hz: tuple[float, ...] = ()) -> float:
    """Compute the true difference in dB: median threshold at the first frequency of `find_judged_pair` over that at the
    second."""
    medians_n = dict(zip(crowd.frequencies_hz, crowd.medians_n, strict=True))
    first_hz, second_hz = find_judged_pair(crowd.frequencies_hz, contrast_hz)
    return 20.0 * float(np.log10(medians_n[first_hz] / medians_n[second_hz]))


@cache
def _compute_critical_range(group_count: int, df: int) -> float:
    """Compute the quantile of the studentized range for Tukey's test with groups of equal size. Cached: computing it
    takes as long as simulating a study."""
    return float(studentized_range.ppf(CONFIDENCE, group_count, df))


def summarise_power(verdicts: Sequence[StudyVerdict]) -> PowerPoint:
    """Summarise simulated studies as shares and biases. verdicts: at least one, all with the same number of people."""
    study_count = len(verdicts)
    return PowerPoint(
        people=verdicts[0].people,
        studies=study_count,
        trials_per_person=sum(verdict.trials for verdict in verdicts) / study_count / verdicts[0].people,
        primary=_compute_wilson_share([verdict.primary_found for verdict in verdicts]),
        means=_compute_wilson_share([verdict.means_found for verdict in verdicts]),
        published=_compute_wilson_share([verdict.published_found for verdict in verdicts]),
        coverage=_compute_wilson_share([verdict.primary_covers for verdict in verdicts]),
        primary_bias_db=float(np.mean([verdict.primary_error_db for verdict in verdicts])),
        means_bias_db=float(np.mean([verdict.means_error_db for verdict in verdicts])),
    )


def _compute_wilson_share(outcomes: Sequence[bool]) -> Share:
    """Compute the share of true values, with Wilson's 95 % interval."""
    lower, upper = compute_wilson_interval(sum(outcomes), len(outcomes))
    return Share(sum(outcomes) / len(outcomes), lower, upper)
