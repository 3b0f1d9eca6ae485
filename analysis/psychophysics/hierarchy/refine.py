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
SHORTER = 3
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
        coarse = self._climb(self._begin(parameters, COARSE), COARSE)
        fine = self._climb(self._evaluate(coarse.parameters, coarse.moments, FINE), FINE)
        if fine.converged:
            return fine
        return self._climb(self._evaluate(fine.parameters, fine.moments, FIXED), FIXED)

    def lowest_cost(self, parameters: FloatArray, held: int | None = None) -> float:
        """Lowest cost near these parameters, by coarse nodes. held: index of a parameter that keeps its value (profile
        likelihood)."""
        found = self._climb(self._begin(parameters, COARSE), COARSE, held)
        if not found.converged:
            laplace = maximise(self.objective, parameters, held).x
            found = self._climb(self._begin(laplace, COARSE), COARSE, held)
        # The quadratic approximation gives the rest of the way to the minimum: half the Newton decrement.
        return found.cost + 0.5 * float(found.slope @ self._newton_step(found, held))

    def _begin(self, parameters: FloatArray, counts: Counts) -> Refined:
        """Evaluation at the parameters, clipped to their bounds, with nodes placed by Laplace's method."""
        parameters = np.clip(parameters, self._lower, self._upper)
        moments = laplace_moments(parameters, *self.objective.marginal.centres(parameters))
        return self._evaluate(parameters, moments, counts)

    def _climb(self, at: Refined, counts: Counts, held: int | None = None) -> Refined:
        """Newton's method from `at` until the decrement is below `SETTLED`; `converged` is False where it is not."""
        for _ in range(NEWTON_STEPS):
            step = self._newton_step(at, held)
            if -float(at.slope @ step) < SETTLED[counts]:
                return at
            share = 1.0 / max(1.0, float(np.abs(step / self._longest).max()))
            for _ in range(SHORTER):
                then = self._evaluate(
                    np.clip(at.parameters + share * step, self._lower, self._upper), at.moments, counts
                )
                if then.cost <= at.cost + SAME_HEIGHT:
                    break
                share /= 4.0
            else:
                # No step lowers the cost, because the nodes do not fit the posterior yet: place them anew, by the
                # moments of the last evaluation, without a step.
                then = self._evaluate(at.parameters, at.moments, counts)
            at = replace(then, moments=at.moments) if counts is FIXED else then
        return replace(at, converged=False)

    def _newton_step(self, at: Refined, held: int | None) -> FloatArray:
        """Newton step (size,); 0 for the held parameter, and for parameters at a bound that the step would cross."""
        pushed = ((at.parameters <= self._lower) & (at.slope > 0)) | ((at.parameters >= self._upper) & (at.slope < 0))
        free = (np.arange(len(at.parameters)) != held) & ~pushed
        values, vectors = np.linalg.eigh(at.curvature[np.ix_(free, free)])
        step = np.zeros(len(at.parameters))
        # Eigenvalues by magnitude: the step lowers the cost also where the curvature is negative.
        step[free] = -vectors @ ((vectors.T @ at.slope[free]) / np.maximum(np.abs(values), LEAST_CURVATURE))
        return step

    def _evaluate(self, parameters: FloatArray, moments: Moments, counts: Counts) -> Refined:
        """Cost with derivatives at the parameters, by nodes placed by the moments."""
        found = integrate(self._quadrature, parameters, moments, counts)
        penalty, slope = self.objective.penalty(parameters)
        value = float(found.value.sum())
        return Refined(
            parameters=parameters,
            cost=-value - penalty,
            log_likelihood=value,
            scores=found.scores,
            curvature=-found.hessian - self.objective.penalty_hessian(parameters),
            slope=-found.scores.sum(axis=0) - slope,
            moments=found.moments,
            converged=True,
        )
