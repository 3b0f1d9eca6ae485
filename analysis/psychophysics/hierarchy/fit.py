"""Fit of the hierarchical psychometric model to all answers of a study, by penalized maximum marginal likelihood.

Each of n persons has a threshold (dB) at each of k frequencies, a log-slope and a response criterion. These latent
parameters are drawn from normal distributions, whose means and standard deviations are estimated (`marginal`, with the
sources). The latent parameters are integrated out, first by Laplace's method (`objective`), then by adaptive quadrature
(`quadrature_search`).
"""

from dataclasses import dataclass

import numpy as np
from scipy.special import expit

from analysis.psychophysics.hierarchy.answers import Answers
from analysis.psychophysics.hierarchy.curve import Family
from analysis.psychophysics.hierarchy.marginal import ParameterLayout
from analysis.psychophysics.hierarchy.objective import Objective, Prior, maximise
from analysis.psychophysics.hierarchy.quadrature_search import QuadratureSearch
from equalizer.signals.signal import FloatArray


@dataclass(frozen=True, slots=True, eq=False)
class HierarchicalFit:
    """Fitted parameters of the population and of n persons at k frequencies, with the derivatives of the likelihood at
    the maximum."""

    answers: Answers
    family: Family
    parameters: FloatArray
    """(k + 6,): see `marginal.ParameterLayout`."""
    latent: FloatArray
    """(n, k + 2): posterior modes of each person's thresholds (dB), log-slope and criterion, at the population's
    parameters."""
    shared_means: FloatArray
    """(n, 2): posterior means of each person's log-slope and criterion, which all frequencies share, with the
    thresholds integrated out. In the joint mode (`latent`) slopes are too steep, because each threshold adapts to its
    own answers."""
    shared_errors: FloatArray
    """(n, 2): posterior standard deviations of `shared_means`."""
    log_likelihood: float
    """Log marginal likelihood of all answers, without the penalty."""
    scores: FloatArray
    """(n, k + 6): gradient of each person's log marginal likelihood at the parameters."""
    curvature: FloatArray
    """(k + 6, k + 6): Hessian of minus the penalized log marginal likelihood."""
    converged: bool
    """Whether the last Newton search converged within `quadrature_search.MOST_NEWTON_STEPS` steps."""

    @property
    def layout(self) -> ParameterLayout:
        """Indices of the parameters."""
        return ParameterLayout(len(self.answers.frequencies_hz))

    @property
    def means_db(self) -> FloatArray:
        """(k,): median participant's threshold at each frequency, in the unit of `Answers.level_db`."""
        return self.parameters[: self.layout.k]

    @property
    def lapse(self) -> float:
        """Lapse rate common to all persons: probability of a wrong answer at the highest levels (see
        `curve.compute_proportion_correct`)."""
        return float(expit(self.parameters[self.layout.lapse]))


def fit_hierarchy(answers: Answers, family: Family = Family.WEIBULL, prior: Prior | None = None) -> HierarchicalFit:
    """Fit the population parameters by maximum a posteriori, with all persons' latent parameters integrated out: first
    by Laplace's method, then by quadrature. answers: of at least two persons. prior: None = the defaults of `Prior`."""
    objective = Objective(answers, family, prior or Prior())
    maximum = QuadratureSearch(objective).find_maximum(maximise(objective, objective.start).x)
    return HierarchicalFit(
        answers=answers,
        family=family,
        parameters=maximum.parameters,
        latent=objective.marginal.find_modes(maximum.parameters)[0],
        shared_means=maximum.moments.shared_means[:, 1:],
        shared_errors=np.sqrt(np.diagonal(maximum.moments.covariance, axis1=1, axis2=2)[:, 1:]),
        log_likelihood=maximum.log_likelihood,
        scores=maximum.scores,
        curvature=maximum.hessian,
        converged=maximum.converged,
    )
