"""Penalized log marginal likelihood of the population's parameters, and its maximum by Laplace's method.

Objective: sum of the persons' log marginal likelihoods (`marginal`) plus the log density of a weak prior (`Prior`),
which keeps standard deviations, lapse rate and means finite where the answers do not determine them. The maximum is
found by L-BFGS-B with the exact gradient of Laplace's approximation; `quadrature_search` starts from it.
"""

from dataclasses import dataclass

import numpy as np
from scipy.optimize import OptimizeResult, minimize
from scipy.special import expit, logit

from analysis.psychophysics.hierarchy.answers import Answers
from analysis.psychophysics.hierarchy.curve import STARTING_SLOPE, Family
from analysis.psychophysics.hierarchy.likelihood import TrialLikelihood
from analysis.psychophysics.hierarchy.marginal import MarginalLikelihood, ParameterLayout
from equalizer.signals.signal import FloatArray


@dataclass(frozen=True, slots=True)
class Prior:
    """Prior distributions of the population parameters, weak enough for the answers of a study to outweigh them."""

    lapse_beta: float = 40.0
    lapse_alpha: float = 1.0
    """Shape parameters of the beta distribution of the lapse rate p, as a density of logit p: p^alpha (1 - p)^beta up
    to a constant. Equivalent to one lapse in 41 trials far above threshold. Attentive adults lapse in 0 to 5 %; some
    hundred trials above threshold outweigh the prior."""
    log_sd_weight: float = 1.0
    """The log prior of each standard deviation is log_sd_weight * log SD. With 1.0 it is the limit, for a rate towards
    0, of a gamma distribution with shape 2 (Y. Chung et al., Psychometrika 78 (2013), 685-709), which moves an estimate
    that would be 0 by about one standard error."""
    mean_sd_db: float = 30.0
    """SD (dB) of a normal distribution of each mean around the average level played. It keeps a mean finite that the
    answers do not determine (all guess at the cap); a mean 10 dB away from that level moves by 0.01 dB."""


LOG_SD_BOUNDS = ((-5.0, 3.5), (-5.0, 3.5), (-5.0, 0.7), (-5.0, 1.1))
"""Bounds of the log standard deviations, in the order of `ParameterLayout.log_sds`: 0.007 to 33 dB, up to 2 in
log-slopes, up to 3 in d'. At the lower bound persons are alike; at the upper bound they have practically nothing in
common."""
LOG_SLOPE_BOUNDS = (-5.0, 7.0)
"""Bounds of the mean log-slope: slopes of 0.007, practically constant over all levels, to 1100, practically a step.
Answers that are all right above some level and all wrong below it do not bound it, and the derivatives of far steeper
curves overflow. Chosen."""
LAPSE_BOUNDS = (float(logit(1e-4)), float(logit(0.3)))
"""Bounds of the lapse rate (logit): 0.01 % to 30 %."""


class Objective:
    """Minus the penalized log marginal likelihood with its gradient, as a function to minimise. `start`: starting
    values (size,) of the parameters in the order of `ParameterLayout`."""

    def __init__(self, answers: Answers, family: Family, prior: Prior) -> None:
        self.answers, self.family = answers, family
        self.prior, self.layout = prior, ParameterLayout(len(answers.frequencies_hz))
        start = choose_starting_parameters(answers, family)
        k = self.layout.k
        latent_start = np.tile(np.concatenate([start[:k], [start[self.layout.slope], 0.0]]), (answers.persons, 1))
        # (persons, k + 2): each person's thresholds (dB), log-slope and criterion, from the population's values.
        self.marginal = MarginalLikelihood(TrialLikelihood(answers, family), latent_start)
        self.start = start
        self._mean_level_db = float(np.average(answers.level_db, weights=answers.right + answers.wrong))

    def __call__(self, parameters: FloatArray) -> tuple[float, FloatArray]:
        """Compute value and gradient (size,) at the parameters (size,) of `ParameterLayout`."""
        value, scores = self.marginal.evaluate(parameters)
        log_prior, prior_gradient = self.evaluate_log_prior(parameters)
        return -float(value.sum()) - log_prior, -scores.sum(axis=0) - prior_gradient

    def evaluate_log_prior(self, parameters: FloatArray) -> tuple[float, FloatArray]:
        """Evaluate the log density of the prior, up to a constant, and its gradient (size,)."""
        layout, prior = self.layout, self.prior
        lapse = float(expit(parameters[layout.lapse]))
        gradient = np.zeros(layout.size)
        gradient[layout.log_sds] = prior.log_sd_weight
        deviation = parameters[: layout.k] - self._mean_level_db
        gradient[: layout.k] = -deviation / prior.mean_sd_db**2
        gradient[layout.lapse] = prior.lapse_alpha * (1.0 - lapse) - prior.lapse_beta * lapse
        value = prior.lapse_alpha * np.log(lapse) + prior.lapse_beta * np.log1p(-lapse)
        value -= 0.5 * float(deviation @ deviation) / prior.mean_sd_db**2
        return float(value + prior.log_sd_weight * parameters[layout.log_sds].sum()), gradient

    def compute_log_prior_hessian(self, parameters: FloatArray) -> FloatArray:
        """Compute the Hessian (size, size) of the log density of the prior, which is diagonal."""
        layout, prior = self.layout, self.prior
        lapse = float(expit(parameters[layout.lapse]))
        diagonal = np.zeros(layout.size)
        diagonal[: layout.k] = -1.0 / prior.mean_sd_db**2
        diagonal[layout.lapse] = -(prior.lapse_alpha + prior.lapse_beta) * lapse * (1.0 - lapse)
        return np.diag(diagonal)

    @property
    def bounds(self) -> list[tuple[float | None, float | None]]:
        """Lower and upper bound of each parameter, None = unbounded; a new list, which the caller may change."""
        bounds: list[tuple[float | None, float | None]] = [(None, None)] * self.layout.size
        for index, limits in zip(self.layout.log_sds, LOG_SD_BOUNDS, strict=True):
            bounds[index] = limits
        bounds[self.layout.slope], bounds[self.layout.lapse] = LOG_SLOPE_BOUNDS, LAPSE_BOUNDS
        return bounds


def choose_starting_parameters(answers: Answers, family: Family) -> FloatArray:
    """Choose starting values (k + 6,) of the population parameters, in the order of `ParameterLayout`: for the means
    the average level played (dB) at each frequency, for the others typical values, as logarithms or logits."""
    k = len(answers.frequencies_hz)
    trials = answers.right + answers.wrong
    frequency_index = answers.run % k
    answer_counts = np.bincount(frequency_index, weights=trials, minlength=k)
    level_sums = np.bincount(frequency_index, weights=trials * answers.level_db, minlength=k)
    means = np.where(
        answer_counts > 0, level_sums / np.maximum(answer_counts, 1), level_sums.sum() / answer_counts.sum()
    )
    # SDs of 2.5 dB (persons), 2.0 dB (person x frequency), 0.30 (log-slope) and 0.20 d' (criterion); lapse rate 2 %.
    return np.concatenate([means, [0.9, 0.7, np.log(STARTING_SLOPE[family]), -1.2, -1.6, logit(0.02)]])


def maximise(objective: Objective, start: FloatArray, fixed_index: int | None = None) -> OptimizeResult:
    """Maximise the penalised likelihood by minimising `objective`, from `start` (size,), which is first clipped to the
    bounds. fixed_index: index of a parameter that is fixed at its value in `start` (profile likelihood)."""
    bounds = objective.bounds
    if fixed_index is not None:
        bounds[fixed_index] = (float(start[fixed_index]), float(start[fixed_index]))
    # Tolerances and limit are chosen: the search by quadrature continues from the result, so that an error of some
    # hundredths of a standard error is acceptable.
    options = {"maxiter": 300, "ftol": 1e-7, "gtol": 1e-3, "maxcor": 20}
    start = np.clip(
        start,
        *np.array(
            [(-np.inf if lower is None else lower, np.inf if upper is None else upper) for lower, upper in bounds]
        ).T,
    )
    return minimize(objective, start, jac=True, method="L-BFGS-B", bounds=bounds, options=options)
