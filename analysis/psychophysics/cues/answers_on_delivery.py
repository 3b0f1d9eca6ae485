"""Whether answers followed the delivery within a direction: logistic regression of answers on residuals.

A residual is a trial's cue value against the others of that participant, direction and level, so the direction itself
explains none of it. A participant who takes "stronger" for the first direction answers "first" more often at positive
residuals, whichever direction was played. One who feels directions does not: more strength then makes both directions
clearer, which is a term of its own.

    logit P(answer first) = person + side (a + b level + c residual) + g residual

Spectrum and coupling are asked beside the strength, its residual with the same two terms: where the level is roved,
what is not in proportion to it follows it. The level is in dB from the mean of the participant's levels; g is the cue,
in logits per dB. Answers follow levels and levels earlier answers, but the residual of a trial depends on neither.

Source: the regression of answers on trial-by-trial stimuli, A. J. Ahumada, J. Lovell, J. Acoust. Soc. Am. 49 (1971),
1751-1756.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import expit
from scipy.stats import norm

from analysis.psychophysics.cues.cue_ability import USUAL_NOISE_DB, same_level_difference
from analysis.psychophysics.cues.delivered_cues import Cue, DeliveredTrials
from equalizer.signals.signal import FloatArray

LOGITS_PER_D = 1.702
"""A logistic curve over this times z is a normal one within 0.01 (D. C. Haley, Stanford technical report 15, 1952)."""
CUE_ONLY_SLOPE = LOGITS_PER_D / USUAL_NOISE_DB
"""Slope in logits per dB of a participant with the usual internal noise who goes by the cue alone."""
STEPS, SETTLED = 50, 1e-8
"""Most Newton steps of the logistic regression, and relative change at which it has converged."""
LEAST_SD_DB = 1e-6
"""A residual that varies by less is rounding."""


@dataclass(frozen=True, slots=True)
class AnswersOnDelivery:
    """One cue at one frequency, over all participants."""

    frequency_hz: float
    cue: Cue
    trials: int
    residual_sd_db: float
    slope: float | None
    """g, in logits per dB: positive where more of the cue goes with answers of the first direction. None where the
    delivery did not vary within a direction, or the answers fix no slope."""
    lower: float | None
    upper: float | None
    """95 %."""
    p: float | None

    @property
    def is_conclusive(self) -> bool:
        """Whether a participant who relied on the cue would have shown: the interval is narrower than that slope."""
        return self.lower is not None and self.upper is not None and self.upper - self.lower < CUE_ONLY_SLOPE


def answers_on_delivery(trials: DeliveredTrials) -> tuple[AnswersOnDelivery, ...]:
    """A regression for each cue; all but the strength have the strength's residual beside theirs."""
    strength = trials.values_db.get(Cue.INTENSITY)
    return tuple(
        _regress(trials, cue, values_db, None if cue is Cue.INTENSITY else strength)
        for cue, values_db in trials.values_db.items()
    )


def _regress(
    trials: DeliveredTrials, cue: Cue, values_db: FloatArray, strength_db: FloatArray | None
) -> AnswersOnDelivery:
    """strength_db: asked beside the cue; None = it is the cue, or was not measured."""
    residual, has_residual = _residuals(trials, values_db)
    n = int(has_residual.sum())
    if n == 0:
        return AnswersOnDelivery(trials.frequency_hz, cue, 0, 0.0, None, None, None, None)
    residual, person, side, answer = (
        residual[has_residual],
        trials.person[has_residual],
        trials.side[has_residual],
        trials.answer[has_residual],
    )
    sd = float(residual.std())
    slope = error = None
    if sd > LEAST_SD_DB:
        level = trials.nominal_db[has_residual] - _group_means(trials.nominal_db[has_residual], person)
        people = (person[:, None] == np.unique(person)).astype(np.float64)
        strength_terms = _strength_terms(trials, strength_db, has_residual)
        side_terms = np.column_stack([np.ones(n), level, residual / sd, strength_terms])
        design = np.column_stack([people, side[:, None] * side_terms, strength_terms, residual / sd])
        slope, error = _logistic_slope(design, answer > 0)
    if slope is None or error is None:
        return AnswersOnDelivery(trials.frequency_hz, cue, n, sd, None, None, None, None)
    half_width = float(norm.ppf(0.975)) * error
    return AnswersOnDelivery(
        trials.frequency_hz, cue, n, sd, slope / sd, (slope - half_width) / sd, (slope + half_width) / sd,
        float(2.0 * norm.sf(abs(slope / error))),
    )  # fmt: skip


def _strength_terms(
    trials: DeliveredTrials, strength_db: FloatArray | None, has_residual: NDArray[np.bool_]
) -> FloatArray:
    """(n, 1), standardised; (n, 0) where it was not measured or did not vary."""
    residual = (
        np.zeros(int(has_residual.sum())) if strength_db is None else _residuals(trials, strength_db)[0][has_residual]
    )
    sd = float(residual.std())
    return residual[:, None] / sd if sd > LEAST_SD_DB else np.zeros((len(residual), 0))


def _residuals(trials: DeliveredTrials, values_db: FloatArray) -> tuple[FloatArray, NDArray[np.bool_]]:
    """(n,), and where they are known: not for a trial without the value, nor a participant with too few of them."""
    residual, has_residual = np.zeros(len(values_db)), np.zeros(len(values_db), dtype=np.bool_)
    for person in range(len(trials.subjects)):
        of_person = (trials.person == person) & np.isfinite(values_db)
        fit = same_level_difference(values_db[of_person], trials.nominal_db[of_person], trials.side[of_person])
        if fit is not None:
            residual[of_person], has_residual[of_person] = fit.residual_db, True
    return residual, has_residual


def _group_means(values: FloatArray, group: NDArray[np.intp]) -> FloatArray:
    """Each entry's mean over its group."""
    _, group_index = np.unique(group, return_inverse=True)
    means: FloatArray = (np.bincount(group_index, weights=values) / np.bincount(group_index))[group_index]
    return means


def _logistic_slope(design: FloatArray, answered: NDArray[np.bool_]) -> tuple[float, float] | tuple[None, None]:
    """Last coefficient of a logistic regression, and its standard error; None where the answers fix none.

    Newton's method, its step halved where it does not gain; the log-likelihood is concave.
    """
    beta = np.zeros(design.shape[1])
    value = _log_likelihood(design, answered, beta)
    for _ in range(STEPS):
        p = expit(design @ beta)
        information = design.T @ (design * (p * (1.0 - p))[:, None])
        if np.linalg.cond(information) > 1e12:
            return None, None
        step = np.linalg.solve(information, design.T @ (answered - p))
        step_fraction = 1.0
        while (
            trial_value := _log_likelihood(design, answered, beta + step_fraction * step)
        ) < value and step_fraction > 1e-3:
            step_fraction /= 2.0
        beta, gain, value = beta + step_fraction * step, trial_value - value, trial_value
        if abs(gain) < SETTLED:
            return float(beta[-1]), math.sqrt(float(np.linalg.inv(information)[-1, -1]))
    return None, None


def _log_likelihood(design: FloatArray, answered: NDArray[np.bool_], beta: FloatArray) -> float:
    eta = design @ beta
    return float((answered * eta - np.logaddexp(0.0, eta)).sum())
