"""Logistic regression of the answers on the delivered stimulus within a direction: did answers depend on a cue?

A residual is a trial's cue value minus the value fitted for that participant, direction and level, so the direction
itself explains none of it. A participant who judges by intensity answers "first" more often (or less often) at positive
residuals, whichever direction was played. For a participant who judges by direction, more intensity makes both
directions clearer, which is the separate term c.

    logit P(answer first) = person + side (a + b level + c residual) + g residual

side is +1 or -1 for the direction shown. For spectrum and coupling, the residual of the intensity is added with the
same two terms, as both vary with a roved level. The level is in dB from the mean of the participant's levels; g is the
effect of the cue, in logits per dB. The staircase makes levels depend on earlier answers, but not the residual of a
trial.

Source: the regression of answers on trial-by-trial stimuli, A. J. Ahumada, J. Lovell, J. Acoust. Soc. Am. 49 (1971),
1751-1756.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import expit
from scipy.stats import norm

from analysis.psychophysics.cues.cue_sensitivity import TYPICAL_NOISE_DB, fit_same_level_difference
from analysis.psychophysics.cues.delivered_cues import Cue, DeliveredTrials
from equalizer.signals.signal import FloatArray

LOGITS_PER_D = 1.702
"""Factor c with logistic(c z) = Phi(z) within 0.01 for all z (D. C. Haley, Stanford technical report 15, 1952)."""
CUE_ONLY_SLOPE = LOGITS_PER_D / TYPICAL_NOISE_DB
"""Slope (logits per dB) of a participant with the internal noise `TYPICAL_NOISE_DB` who judges by the cue alone."""
MOST_NEWTON_STEPS, LEAST_LIKELIHOOD_GAIN = 50, 1e-8
"""Largest number of Newton steps of the logistic regression, and gain in log-likelihood below which it has converged.
Chosen."""
LEAST_RESIDUAL_SD_DB = 1e-6
"""Standard deviation (dB) of residuals up to which they count as rounding errors. Chosen."""


@dataclass(frozen=True, slots=True)
class AnswerRegression:
    """Result of the regression on one cue at one frequency, over all participants."""

    frequency_hz: float
    cue: Cue
    trials: int
    """Number of trials with a residual."""
    residual_sd_db: float
    """Standard deviation of the residuals; 0 without trials."""
    slope: float | None
    """g, in logits per dB: positive where more of the cue goes with answers of the direction of side +1. None without
    trials, where the delivery did not vary within a direction, or where the answers do not determine it."""
    lower: float | None
    upper: float | None
    """Limits of the 95 % Wald interval of the slope, logits per dB."""
    p: float | None
    """Two-sided p-value of the Wald test of g = 0."""

    @property
    def is_conclusive(self) -> bool:
        """Whether the test could detect reliance on the cue: its interval is narrower than `CUE_ONLY_SLOPE`."""
        return self.lower is not None and self.upper is not None and self.upper - self.lower < CUE_ONLY_SLOPE


def regress_answers_on_delivery(trials: DeliveredTrials) -> tuple[AnswerRegression, ...]:
    """Compute a regression for each measured cue; all but that on the intensity include the residual of the
    intensity."""
    intensity_db = trials.values_db.get(Cue.INTENSITY)
    return tuple(
        _regress_answers_on_cue(trials, cue, values_db, None if cue is Cue.INTENSITY else intensity_db)
        for cue, values_db in trials.values_db.items()
    )


def _regress_answers_on_cue(
    trials: DeliveredTrials, cue: Cue, values_db: FloatArray, intensity_db: FloatArray | None
) -> AnswerRegression:
    """Regress the answers on one cue. values_db: (n,), values of the cue. intensity_db: (n,), intensity as a further
    regressor; None = it is the cue itself, or was not measured."""
    residual_db, has_residual = _compute_residuals(trials, values_db)
    trial_count = int(has_residual.sum())
    if trial_count == 0:
        return AnswerRegression(trials.frequency_hz, cue, 0, 0.0, None, None, None, None)
    residual_db, person_index, side_sign, answer_sign = (
        residual_db[has_residual],
        trials.person[has_residual],
        trials.side[has_residual],
        trials.answer[has_residual],
    )
    residual_sd_db = float(residual_db.std())
    slope = standard_error = None
    if residual_sd_db > LEAST_RESIDUAL_SD_DB:
        centred_level_db = trials.nominal_db[has_residual] - _compute_group_means(
            trials.nominal_db[has_residual], person_index
        )
        person_indicators = (person_index[:, None] == np.unique(person_index)).astype(np.float64)
        intensity_terms = _make_intensity_terms(trials, intensity_db, has_residual)
        side_terms = np.column_stack(
            [np.ones(trial_count), centred_level_db, residual_db / residual_sd_db, intensity_terms]
        )
        design = np.column_stack(
            [person_indicators, side_sign[:, None] * side_terms, intensity_terms, residual_db / residual_sd_db]
        )
        slope, standard_error = _fit_logistic_slope(design, answer_sign > 0)
    if slope is None or standard_error is None:
        return AnswerRegression(trials.frequency_hz, cue, trial_count, residual_sd_db, None, None, None, None)
    half_width = float(norm.ppf(0.975)) * standard_error
    return AnswerRegression(
        trials.frequency_hz, cue, trial_count, residual_sd_db, slope / residual_sd_db,
        (slope - half_width) / residual_sd_db, (slope + half_width) / residual_sd_db,
        float(2.0 * norm.sf(abs(slope / standard_error))),
    )  # fmt: skip


def _make_intensity_terms(
    trials: DeliveredTrials, intensity_db: FloatArray | None, has_residual: NDArray[np.bool_]
) -> FloatArray:
    """Make the residual of the intensity as a regressor (n, 1), divided by its standard deviation; (n, 0) where it was
    not measured or did not vary."""
    residual_db = (
        np.zeros(int(has_residual.sum()))
        if intensity_db is None
        else _compute_residuals(trials, intensity_db)[0][has_residual]
    )
    residual_sd_db = float(residual_db.std())
    return (
        residual_db[:, None] / residual_sd_db
        if residual_sd_db > LEAST_RESIDUAL_SD_DB
        else np.zeros((len(residual_db), 0))
    )


def _compute_residuals(trials: DeliveredTrials, values_db: FloatArray) -> tuple[FloatArray, NDArray[np.bool_]]:
    """Compute the residuals (n,) in dB, and a mask (n,) of where they exist: not for a trial without the value, nor for
    a participant for whom `fit_same_level_difference` gives None."""
    residual_db, has_residual = np.zeros(len(values_db)), np.zeros(len(values_db), dtype=np.bool_)
    for person in range(len(trials.subjects)):
        is_of_person = (trials.person == person) & np.isfinite(values_db)
        fit = fit_same_level_difference(
            values_db[is_of_person], trials.nominal_db[is_of_person], trials.side[is_of_person]
        )
        if fit is not None:
            residual_db[is_of_person], has_residual[is_of_person] = fit.residual_db, True
    return residual_db, has_residual


def _compute_group_means(values: FloatArray, group_of_value: NDArray[np.intp]) -> FloatArray:
    """Compute the mean of each value's group, (n,). group_of_value: (n,), index of the group."""
    _, group_index = np.unique(group_of_value, return_inverse=True)
    means: FloatArray = (np.bincount(group_index, weights=values) / np.bincount(group_index))[group_index]
    return means


def _fit_logistic_slope(
    design: FloatArray, answered_first: NDArray[np.bool_]
) -> tuple[float, float] | tuple[None, None]:
    """Fit a logistic regression; returns the last coefficient and its standard error, None where they are not
    determined (condition number of the information above 1e12, chosen) or the search does not converge. design: (n, p);
    answered_first: (n,).

    Newton's method, each step halved up to ten times until the log-likelihood, which is concave, does not fall.
    """
    beta = np.zeros(design.shape[1])
    log_likelihood = _compute_log_likelihood(design, answered_first, beta)
    for _ in range(MOST_NEWTON_STEPS):
        probability = expit(design @ beta)
        information = design.T @ (design * (probability * (1.0 - probability))[:, None])
        # Near-singular information: the answers are separated, or a regressor is a combination of others.
        if np.linalg.cond(information) > 1e12:
            return None, None
        step = np.linalg.solve(information, design.T @ (answered_first - probability))
        step_fraction = 1.0
        while (
            new_log_likelihood := _compute_log_likelihood(design, answered_first, beta + step_fraction * step)
        ) < log_likelihood and step_fraction > 1e-3:
            step_fraction /= 2.0
        beta, likelihood_gain, log_likelihood = (
            beta + step_fraction * step,
            new_log_likelihood - log_likelihood,
            new_log_likelihood,
        )
        if abs(likelihood_gain) < LEAST_LIKELIHOOD_GAIN:
            return float(beta[-1]), math.sqrt(float(np.linalg.inv(information)[-1, -1]))
    return None, None


def _compute_log_likelihood(design: FloatArray, answered_first: NDArray[np.bool_], beta: FloatArray) -> float:
    """Compute the Bernoulli log-likelihood of the coefficients beta (p,). design: (n, p); answered_first: (n,)."""
    logit = design @ beta
    return float((answered_first * logit - np.logaddexp(0.0, logit)).sum())
