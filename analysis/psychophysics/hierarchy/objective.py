"""Penalized log marginal likelihood of the population's parameters, and its maximum by Laplace's method.

Objective: sum of the persons' log marginal likelihoods (`marginal`) plus the log density of a weak prior (`Prior`),
which keeps standard deviations, lapse rate and means finite where the answers do not determine them. The maximum is
found by L-BFGS-B with the exact gradient; `refine` starts from it.
"""

from dataclasses import dataclass

import numpy as np
from scipy.optimize import OptimizeResult, minimize
from scipy.special import expit, logit

from analysis.psychophysics.hierarchy.answers import Answers
from analysis.psychophysics.hierarchy.curve import USUAL_SLOPE, Family
from analysis.psychophysics.hierarchy.likelihood import TrialLikelihood
from analysis.psychophysics.hierarchy.marginal import Layout, Marginal
from equalizer.signals.signal import FloatArray


@dataclass(frozen=True, slots=True)
class Prior:
    """Prior distributions of the population parameters, weak enough for the answers of a study to outweigh them."""

    lapse_right: float = 40.0
    lapse_wrong: float = 1.0
    """Beta distribution of the lapse rate, as a density of its logit: as if one lapse had been seen in 41 trials far
    above threshold. Attentive adults lapse in 0 to 5 %; some hundred trials above threshold outweigh the prior."""
    spread: float = 1.0
    """Factor of the log SD in the log prior of each standard deviation: the gamma distribution of shape 2 and rate
    towards 0 of Y. Chung et al., Psychometrika 78 (2013), 685-709. It moves an estimate that would be 0 by about one
    standard error."""
    mean_sd_db: float = 30.0
    """SD of a normal distribution of each mean around the average level played. It keeps a mean finite that the answers
    do not determine (all guess at the cap); a mean 10 dB away from that level moves by 0.01 dB."""


LOG_SD_BOUNDS = ((-5.0, 3.5), (-5.0, 3.5), (-5.0, 0.7), (-5.0, 1.1))
"""Bounds of the log standard deviations, in the order of `Layout.log_sds`: 0.007 to 33 dB, up to 2 in log-slopes, up to
3 in d'. At the lower bound persons are alike; at the upper bound they have practically nothing in common."""
LAPSE_BOUNDS = (float(logit(1e-4)), float(logit(0.3)))
"""Bounds of the lapse rate (logit): 0.01 % to 30 %."""


class Objective:
    """Minus the penalized log marginal likelihood with its gradient, as a function to minimise."""

    def __init__(self, answers: Answers, family: Family, prior: Prior) -> None:
        self.answers, self.family = answers, family
        self.prior, self.layout = prior, Layout(len(answers.frequencies_hz))
        begin = find_starting_parameters(answers, family)
        k = self.layout.k
        latent = np.tile(np.concatenate([begin[:k], [begin[self.layout.slope], 0.0]]), (answers.persons, 1))
        self.marginal = Marginal(TrialLikelihood(answers, family), latent)
        self.begin = begin
        self._middle_db = float(np.average(answers.level_db, weights=answers.right + answers.wrong))

    def __call__(self, parameters: FloatArray) -> tuple[float, FloatArray]:
        """Value and gradient (size,) at the parameters (size,) of `Layout`."""
        value, scores = self.marginal.evaluate(parameters)
        penalty, slope = self.penalty(parameters)
        return -float(value.sum()) - penalty, -scores.sum(axis=0) - slope

    def penalty(self, parameters: FloatArray) -> tuple[float, FloatArray]:
        """Log density of the prior up to a constant, and its gradient (size,)."""
        layout, prior = self.layout, self.prior
        lapse = float(expit(parameters[layout.lapse]))
        slope = np.zeros(layout.size)
        slope[layout.log_sds] = prior.spread
        away = parameters[: layout.k] - self._middle_db
        slope[: layout.k] = -away / prior.mean_sd_db**2
        slope[layout.lapse] = prior.lapse_wrong * (1.0 - lapse) - prior.lapse_right * lapse
        value = prior.lapse_wrong * np.log(lapse) + prior.lapse_right * np.log1p(-lapse)
        value -= 0.5 * float(away @ away) / prior.mean_sd_db**2
        return float(value + prior.spread * parameters[layout.log_sds].sum()), slope

    def penalty_hessian(self, parameters: FloatArray) -> FloatArray:
        """(size, size): Hessian of the log density of the prior, which is diagonal."""
        layout, prior = self.layout, self.prior
        lapse = float(expit(parameters[layout.lapse]))
        bent = np.zeros(layout.size)
        bent[: layout.k] = -1.0 / prior.mean_sd_db**2
        bent[layout.lapse] = -(prior.lapse_wrong + prior.lapse_right) * lapse * (1.0 - lapse)
        return np.diag(bent)

    @property
    def bounds(self) -> list[tuple[float | None, float | None]]:
        """Lower and upper bound of each parameter, None = unbounded; a new list, which the caller may change."""
        bounds: list[tuple[float | None, float | None]] = [(None, None)] * self.layout.size
        for place, both in zip(self.layout.log_sds, LOG_SD_BOUNDS, strict=True):
            bounds[place] = both
        bounds[self.layout.lapse] = LAPSE_BOUNDS
        return bounds


def find_starting_parameters(answers: Answers, family: Family) -> FloatArray:
    """Starting values of the population parameters (k + 6,): means from the levels played, else usual values."""
    k = len(answers.frequencies_hz)
    trials = answers.right + answers.wrong
    place = answers.run % k
    played = np.bincount(place, weights=trials, minlength=k)
    total = np.bincount(place, weights=trials * answers.level_db, minlength=k)
    means = np.where(played > 0, total / np.maximum(played, 1), total.sum() / played.sum())
    # SDs of 2.5 dB (persons), 2.0 dB (person x frequency), 0.30 (log-slope) and 0.20 d' (criterion); lapse rate 2 %.
    return np.concatenate([means, [0.9, 0.7, np.log(USUAL_SLOPE[family]), -1.2, -1.6, logit(0.02)]])


def maximise(objective: Objective, begin: FloatArray, held: int | None = None) -> OptimizeResult:
    """Maximise the penalised likelihood from `begin` (size,), first clipped to the bounds. held: index of a parameter
    that is fixed at its value in `begin` (profile likelihood)."""
    bounds = objective.bounds
    if held is not None:
        bounds[held] = (float(begin[held]), float(begin[held]))
    # The search by quadrature continues from here, so an error of some hundredths of a standard error is acceptable.
    options = {"maxiter": 300, "ftol": 1e-7, "gtol": 1e-3, "maxcor": 20}
    begin = np.clip(begin, *np.array([(-np.inf if a is None else a, np.inf if b is None else b) for a, b in bounds]).T)
    return minimize(objective, begin, jac=True, method="L-BFGS-B", bounds=bounds, options=options)
