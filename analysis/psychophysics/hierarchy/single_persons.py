"""Thresholds of persons who cannot be compared with others: one participant alone, or people at a single frequency.

Estimates of different persons do not influence each other (no shrinkage). The population parameters of the hierarchical
model are not fitted but fixed, so that its distributions of persons become priors, all normal: each threshold around
the mean level played with an SD of 30 dB, the logarithm of the slope around its usual value with an SD of 0.4 (a factor
of 1.5), the criterion (response bias) around 0 with an SD of 0.3 d'. Only the lapse rate is fitted, under its prior of
`objective.Prior`; then thresholds, slopes and criteria are the maximum a posteriori. Each run also has the likelihood
interval of `likelihood_thresholds`, in which slope, criterion and lapse rate are averaged over the same priors.
"""

import math
from dataclasses import dataclass

import numpy as np
from scipy.optimize import minimize_scalar
from scipy.special import expit
from scipy.stats import beta

from analysis.psychophysics.hierarchy.answers import Answers
from analysis.psychophysics.hierarchy.curve import STARTING_SLOPE, Family
from analysis.psychophysics.hierarchy.likelihood_thresholds import (
    LikelihoodThreshold,
    Nuisance,
    compute_likelihood_thresholds,
)
from analysis.psychophysics.hierarchy.objective import LAPSE_BOUNDS, Objective, Prior
from analysis.psychophysics.hierarchy.primary import (
    CONFIDENCE,
    PersonEstimate,
    drop_unanswered_frequencies,
    estimate_persons,
)
from protocols.procedure.staircase import to_db

SLOPE_LOG_SD, CRITERION_SD = 0.4, 0.3
"""Standard deviations of the priors of a slope's logarithm and of a criterion (d'): 1.6 and 2 times those
among the simulated people of `hapteq power` (`power.simulated_study.Crowd`). Chosen."""
LAPSE_QUANTILES = (1 / 6, 1 / 2, 5 / 6)
"""Quantiles of the lapse rate's prior over which a run's likelihood is averaged: the medians of three equally probable
parts."""
THRESHOLD_SD_DB = 30.0
"""SD (dB) of the prior of each threshold around the mean level played: keeps a threshold finite that the answers do not
bound. Chosen."""


@dataclass(frozen=True, slots=True)
class SinglePersons:
    """Estimates of each person without a population, and likelihood intervals of their runs."""

    family: Family
    """Shape of the psychometric function."""
    frequencies_hz: tuple[float, ...]
    """Frequencies with answers, in ascending order."""
    confidence: float
    """Confidence of the intervals of `runs`, 0 to 1."""
    persons: tuple[PersonEstimate, ...]
    """Most probable thresholds, slope and criterion of each participant."""
    lapse: float
    """Most probable lapse rate (0 to 1), the same for all persons."""
    runs: tuple[LikelihoodThreshold, ...]
    """Likelihood interval of each run."""


def fit_single_persons(
    answers: Answers, cap_n: float, family: Family = Family.WEIBULL, confidence: float = CONFIDENCE
) -> SinglePersons:
    """Fit the most probable thresholds, slopes and criteria at the most probable lapse rate, and the likelihood
    interval of each run. cap_n: cap, the highest level that could be played, N."""
    answers, cap_db, prior = drop_unanswered_frequencies(answers), to_db(cap_n), Prior()
    objective = Objective(answers, family, prior)
    parameters, layout = objective.start.copy(), objective.layout
    parameters[: layout.k] = np.average(answers.level_db, weights=answers.right + answers.wrong)
    # In the order of `ParameterLayout.log_sds`. The part common to all frequencies (SD 1 dB) is negligible.
    parameters[layout.log_sds] = [0.0, math.log(THRESHOLD_SD_DB), math.log(SLOPE_LOG_SD), math.log(CRITERION_SD)]

    def evaluate_cost(logit_lapse: float) -> float:
        parameters[layout.lapse] = logit_lapse
        return objective(parameters)[0]

    parameters[layout.lapse] = minimize_scalar(
        evaluate_cost, bounds=LAPSE_BOUNDS, method="bounded", options={"xatol": 1e-3}
    ).x
    objective(parameters)  # sets `marginal.latent` to the persons' most probable values at this lapse rate
    lapse = float(expit(parameters[layout.lapse]))
    persons = estimate_persons(answers.subjects, objective.marginal.latent, cap_db)
    lapse_nodes = tuple(
        float(lapse_node) for lapse_node in beta.ppf(LAPSE_QUANTILES, prior.lapse_alpha, prior.lapse_beta)
    )
    nuisance = Nuisance(STARTING_SLOPE[family], 0.0, lapse_nodes, SLOPE_LOG_SD, CRITERION_SD)
    runs = compute_likelihood_thresholds(answers, [nuisance] * answers.persons, cap_db, family, confidence)
    return SinglePersons(family, answers.frequencies_hz, confidence, persons, lapse, runs)
