"""Maximum of the penalized marginal likelihood by quadrature, from the maximum by Laplace's method.

Newton's method with the Hessian of `quadrature`: first with coarse nodes, then with fine ones. Nodes are placed anew
after each step by the posterior moments of the last evaluation; a search that does not settle is repeated with nodes
that keep their places. The same search, with a parameter held, gives profile likelihoods for `inference`.
"""

from dataclasses import dataclass, replace

import numpy as np

from analysis.psychophysics.hierarchy.nodes import COARSE, FINE, FIXED, Counts, Moments, laplace_moments
from analysis.psychophysics.hierarchy.objective import Objective, maximise
from analysis.psychophysics.hierarchy.quadrature import Quadrature, integrate
from equalizer.signals.signal import FloatArray

NEWTON_STEPS = 10
"""Largest number of Newton steps of one search. Chosen by hand."""
SETTLED = {COARSE: 0.1, FINE: 1e-3, FIXED: 1e-3}
"""Newton decrement (twice the gain in log-likelihood expected from the next step) below which a search ends, by kind of
nodes: 0.001 is a step of a thirtieth of a standard error."""
LONGEST_STEP = 2.0, 0.5
"""Longest Newton step, in a mean (dB) and in all logarithms."""
LEAST_CURVATURE = 1e-3
"""Least curvature for a Newton step: below it the step's length is undetermined."""
SAME_HEIGHT = 0.03
"""Rise of the cost up to which a step is accepted: the nodes move from step to step, and the value with them."""
STEP_ATTEMPTS = 3
"""Number of attempts per step, each a quarter as long as the one before."""


@dataclass(frozen=True, slots=True, eq=False)
class Refined:
    """The maximum by quadrature, with gradients and Hessian there."""

    parameters: FloatArray
    cost: float
    """Minus the penalized log marginal likelihood."""
    log_likelihood: float
    scores: FloatArray
    """(n, size): gradient of each person's log marginal likelihood."""
    curvature: FloatArray
    """(size, size): Hessian of the cost."""
    slope: FloatArray
    """(size,): gradient of the cost."""
    moments: Moments
    converged: bool


class Refinement:
    """Searches for the maximum of one objective by quadrature."""

    def __init__(self, objective: Objective) -> None:
        self.objective, self._quadrature = objective, Quadrature(objective.answers, objective.family)
        bounds = [(-np.inf if a is None else a, np.inf if b is None else b) for a, b in objective.bounds]
        self._lower, self._upper = np.array(bounds).T
        self._longest = np.full(len(bounds), LONGEST_STEP[1])
        self._longest[: objective.layout.k] = LONGEST_STEP[0]

    def maximum(self, parameters: FloatArray) -> Refined:
        """The maximum by fine nodes; `converged` is False where no search settled. parameters: maximum by Laplace's
        method."""
        coarse = self._search(self._evaluate_start(parameters, COARSE), COARSE)
        fine = self._search(self._evaluate(coarse.parameters, coarse.moments, FINE), FINE)
        if fine.converged:
            return fine
        return self._search(self._evaluate(fine.parameters, fine.moments, FIXED), FIXED)

    def lowest_cost(self, parameters: FloatArray, fixed_index: int | None = None) -> float:
        """Lowest cost near these parameters, by coarse nodes. fixed_index: index of a parameter that keeps its value
        (profile likelihood)."""
        minimum = self._search(self._evaluate_start(parameters, COARSE), COARSE, fixed_index)
        if not minimum.converged:
            laplace = maximise(self.objective, parameters, fixed_index).x
            minimum = self._search(self._evaluate_start(laplace, COARSE), COARSE, fixed_index)
        # The quadratic approximation gives the rest of the way to the minimum: half the Newton decrement.
        return minimum.cost + 0.5 * float(minimum.slope @ self._newton_step(minimum, fixed_index))

    def _evaluate_start(self, parameters: FloatArray, counts: Counts) -> Refined:
        """Evaluation at the parameters, clipped to their bounds, with nodes placed by Laplace's method."""
        parameters = np.clip(parameters, self._lower, self._upper)
        moments = laplace_moments(parameters, *self.objective.marginal.find_modes(parameters))
        return self._evaluate(parameters, moments, counts)

    def _search(self, current: Refined, counts: Counts, fixed_index: int | None = None) -> Refined:
        """Newton's method from `current` until the decrement is below `SETTLED`; `converged` is False where it is
        not."""
        for _ in range(NEWTON_STEPS):
            step = self._newton_step(current, fixed_index)
            if -float(current.slope @ step) < SETTLED[counts]:
                return current
            step_fraction = 1.0 / max(1.0, float(np.abs(step / self._longest).max()))
            for _ in range(STEP_ATTEMPTS):
                trial = self._evaluate(
                    np.clip(current.parameters + step_fraction * step, self._lower, self._upper),
                    current.moments,
                    counts,
                )
                if trial.cost <= current.cost + SAME_HEIGHT:
                    break
                step_fraction /= 4.0
            else:
                # No step lowers the cost, because the nodes do not fit the posterior yet: place them anew, by the
                # moments of the last evaluation, without a step.
                trial = self._evaluate(current.parameters, current.moments, counts)
            current = replace(trial, moments=current.moments) if counts is FIXED else trial
        return replace(current, converged=False)

    def _newton_step(self, current: Refined, fixed_index: int | None) -> FloatArray:
        """Newton step (size,); 0 for the held parameter, and for parameters at a bound that the step would cross."""
        at_bound = ((current.parameters <= self._lower) & (current.slope > 0)) | (
            (current.parameters >= self._upper) & (current.slope < 0)
        )
        free = (np.arange(len(current.parameters)) != fixed_index) & ~at_bound
        values, vectors = np.linalg.eigh(current.curvature[np.ix_(free, free)])
        step = np.zeros(len(current.parameters))
        # Eigenvalues by magnitude: the step lowers the cost also where the curvature is negative.
        step[free] = -vectors @ ((vectors.T @ current.slope[free]) / np.maximum(np.abs(values), LEAST_CURVATURE))
        return step

    def _evaluate(self, parameters: FloatArray, moments: Moments, counts: Counts) -> Refined:
        """Cost with derivatives at the parameters, by nodes placed by the moments."""
        integrals = integrate(self._quadrature, parameters, moments, counts)
        penalty, slope = self.objective.log_prior(parameters)
        value = float(integrals.value.sum())
        return Refined(
            parameters=parameters,
            cost=-value - penalty,
            log_likelihood=value,
            scores=integrals.scores,
            curvature=-integrals.hessian - self.objective.log_prior_hessian(parameters),
            slope=-integrals.scores.sum(axis=0) - slope,
            moments=integrals.moments,
            converged=True,
        )
