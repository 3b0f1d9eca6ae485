"""From the maximum by Laplace's method to the maximum by quadrature, with Newton's method and the exact Hessian."""

from dataclasses import dataclass, replace

import numpy as np

from analysis.psychophysics.hierarchy.nodes import COARSE, FINE, FIXED, Counts, Moments, laplace_moments
from analysis.psychophysics.hierarchy.objective import Objective, maximise
from analysis.psychophysics.hierarchy.quadrature import Quadrature, integrate
from equalizer.signals.signal import FloatArray

NEWTON_STEPS = 10
"""Most Newton steps of one climb to a maximum. By hand."""
SETTLED = {COARSE: 0.1, FINE: 1e-3, FIXED: 1e-3}
"""Twice the gain in log-likelihood that the next step would bring: 0.001 is a thirtieth of a standard error, and the
step before it was that of a quadratic function already."""
LONGEST_STEP = 2.0, 0.5
"""Longest Newton step, in a mean (dB) and in all logarithms."""
LEAST_CURVATURE = 1e-3
"""Least curvature for a Newton step: below it the step's length is undetermined."""
SAME_HEIGHT = 0.03
"""Nodes move from step to step: log-likelihoods closer than this are equal."""
SHORTER = 3
"""Attempts with shorter steps."""


@dataclass(frozen=True, slots=True, eq=False)
class Refined:
    """The maximum by quadrature, with gradients and Hessian there."""

    parameters: FloatArray
    cost: float
    """Minus the penalized log marginal likelihood."""
    log_likelihood: float
    scores: FloatArray
    """(n, size)"""
    curvature: FloatArray
    """(size, size): Hessian of the cost."""
    slope: FloatArray
    """(size,): gradient of the cost."""
    moments: Moments
    converged: bool


class Refinement:
    """Searches by quadrature, for one objective."""

    def __init__(self, objective: Objective) -> None:
        self.objective, self._quadrature = objective, Quadrature(objective.answers, objective.family)
        bounds = [(-np.inf if a is None else a, np.inf if b is None else b) for a, b in objective.bounds]
        self._lower, self._upper = np.array(bounds).T
        self._longest = np.full(len(bounds), LONGEST_STEP[1])
        self._longest[: objective.layout.k] = LONGEST_STEP[0]

    def maximum(self, parameters: FloatArray) -> Refined:
        """parameters: where the search by Laplace's method ended."""
        coarse = self._climb(self._begin(parameters, COARSE), COARSE)
        fine = self._climb(self._evaluate(coarse.parameters, coarse.moments, FINE), FINE)
        if fine.converged:
            return fine
        return self._climb(self._evaluate(fine.parameters, fine.moments, FIXED), FIXED)

    def lowest_cost(self, parameters: FloatArray, held: int | None = None) -> float:
        """Cost at the maximum near these parameters, by coarse nodes. held: index of a parameter that keeps its value
        (profile)."""
        found = self._climb(self._begin(parameters, COARSE), COARSE, held)
        if not found.converged:
            laplace = maximise(self.objective, parameters, held).x
            found = self._climb(self._begin(laplace, COARSE), COARSE, held)
        # What is still missing is known from the curvature.
        return found.cost + 0.5 * float(found.slope @ self._newton_step(found, held))

    def _begin(self, parameters: FloatArray, counts: Counts) -> Refined:
        parameters = np.clip(parameters, self._lower, self._upper)
        moments = laplace_moments(parameters, *self.objective.marginal.centres(parameters))
        return self._evaluate(parameters, moments, counts)

    def _climb(self, at: Refined, counts: Counts, held: int | None = None) -> Refined:
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
                # The nodes were not yet where the person is: again, with those that this evaluation has found.
                then = self._evaluate(at.parameters, at.moments, counts)
            at = replace(then, moments=at.moments) if counts is FIXED else then
        return replace(at, converged=False)

    def _newton_step(self, at: Refined, held: int | None) -> FloatArray:
        """0 for what is held, and for what is at a bound that it would cross."""
        pushed = ((at.parameters <= self._lower) & (at.slope > 0)) | ((at.parameters >= self._upper) & (at.slope < 0))
        free = (np.arange(len(at.parameters)) != held) & ~pushed
        values, vectors = np.linalg.eigh(at.curvature[np.ix_(free, free)])
        step = np.zeros(len(at.parameters))
        # Uphill where the curvature says so, and as far as its size says where it is of the wrong sign.
        step[free] = -vectors @ ((vectors.T @ at.slope[free]) / np.maximum(np.abs(values), LEAST_CURVATURE))
        return step

    def _evaluate(self, parameters: FloatArray, moments: Moments, counts: Counts) -> Refined:
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
