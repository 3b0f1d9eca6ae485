"""Fit of the hierarchical psychometric model to all answers of a study, by penalized maximum marginal likelihood.

Each person has a threshold per frequency, a slope and a criterion, drawn from normal distributions whose parameters are
estimated (`marginal`). The persons' parameters are integrated out, first by Laplace's method (`objective`), then by
adaptive quadrature (`refine`). `inference` takes intervals from the scores and the curvature of the fit.
"""

from dataclasses import dataclass

import numpy as np
from scipy.special import expit

from analysis.psychophysics.hierarchy.answers import Answers
from analysis.psychophysics.hierarchy.curve import Family
from analysis.psychophysics.hierarchy.marginal import Layout
from analysis.psychophysics.hierarchy.objective import Objective, Prior, maximise
from analysis.psychophysics.hierarchy.refine import Refinement
from equalizer.signals.signal import FloatArray


@dataclass(frozen=True, slots=True, eq=False)
class HierarchicalFit:
    """Fitted parameters of the population and of n persons at k frequencies, with the derivatives at the maximum."""

    answers: Answers
    family: Family
    parameters: FloatArray
    """(k + 6,): see `marginal.Layout`."""
    latent: FloatArray
    """(n, k + 2): posterior modes of each person's thresholds (dB), log-slope and criterion, at the population's
    parameters."""
    shared_means: FloatArray
    """(n, 2): posterior means of each person's log-slope and criterion with the thresholds integrated out. In the joint
    mode (`latent`) slopes are too steep, because each threshold adapts to its own answers."""
    shared_errors: FloatArray
    """(n, 2): posterior standard deviations of `shared_means`."""
    log_likelihood: float
    """Log marginal likelihood of all answers, without the penalty."""
    scores: FloatArray
    """(n, k + 6): gradient of each person's log marginal likelihood at the parameters."""
    curvature: FloatArray
    """(k + 6, k + 6): Hessian of minus the penalized log marginal likelihood."""
    converged: bool
    """Whether the last search settled within its number of steps."""

    @property
    def layout(self) -> Layout:
        """Indices of the parameters."""
        return Layout(len(self.answers.frequencies_hz))

    @property
    def means_db(self) -> FloatArray:
        """(k,): median participant's threshold at each frequency, in the unit of `Answers.level_db`."""
        return self.parameters[: self.layout.k]

    @property
    def lapse(self) -> float:
        """Lapse rate common to all persons: probability of a wrong answer at the highest levels (see
        `curve.share_right`)."""
        return float(expit(self.parameters[self.layout.lapse]))


def fit_hierarchy(answers: Answers, family: Family = Family.WEIBULL, prior: Prior | None = None) -> HierarchicalFit:
    """Maximum a posteriori fit of the population parameters, with all persons' latent parameters integrated out: first
    by Laplace's method, then by quadrature. answers: of two persons at least. prior: None: the defaults of `Prior`."""
    objective = Objective(answers, family, prior or Prior())
    maximum = Refinement(objective).maximum(maximise(objective, objective.start).x)
    return HierarchicalFit(
        answers=answers,
        family=family,
        parameters=maximum.parameters,
        latent=objective.marginal.find_modes(maximum.parameters)[0],
        shared_means=maximum.moments.shared[:, 1:],
        shared_errors=np.sqrt(np.diagonal(maximum.moments.covariance, axis1=1, axis2=2)[:, 1:]),
        log_likelihood=maximum.log_likelihood,
        scores=maximum.scores,
        curvature=maximum.curvature,
        converged=maximum.converged,
    )
