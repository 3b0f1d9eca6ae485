"""Maximum of the penalized marginal likelihood by quadrature, from the maximum by Laplace's method.

Newton's method with the Hessian of `quadrature`: first with coarse nodes, then with fine ones. Nodes are placed anew
after each step by the posterior moments of the last evaluation; a search with fine nodes that does not converge is
continued with nodes at fixed positions. With a parameter fixed, coarse nodes give profile likelihoods."""

from dataclasses import dataclass, replace

import numpy as np

from analysis.psychophysics.hierarchy.nodes import (
    COARSE_COUNTS,
    FINE_COUNTS,
    FIXED_COUNTS,
    Moments,
    NodeCounts,
    compute_laplace_moments,
)
from analysis.psychophysics.hierarchy.objective import Objective, maximise
from analysis.psychophysics.hierarchy.quadrature import Quadrature, integrate
from equalizer.signals.signal import FloatArray

MOST_NEWTON_STEPS = 10
"""Largest number of Newton steps of one search. Chosen."""
LARGEST_DECREMENT = {COARSE_COUNTS: 0.1, FINE_COUNTS: 1e-3, FIXED_COUNTS: 1e-3}
"""Newton decrement (twice the gain in log-likelihood expected from the next step) below which a search ends, by kind of
nodes: 0.001 is a step of a thirtieth of a standard error."""
LONGEST_STEPS = 2.0, 0.5
"""Longest Newton step, in a mean (dB), and in every other parameter (logarithms, logits). Chosen."""
LEAST_CURVATURE = 1e-3
"""Least magnitude of an eigenvalue of the Hessian in a Newton step: limits the step where the cost is nearly flat.
Chosen."""
ACCEPTED_COST_RISE = 0.03
"""Rise of the cost up to which a step is accepted: the nodes move from step to step, which changes the value.
Chosen."""
STEP_ATTEMPTS = 3
"""Number of attempts per step, each a quarter as long as the previous one. Chosen."""


@dataclass(frozen=True, slots=True, eq=False)
class QuadratureEvaluation:
    """The penalized marginal likelihood by quadrature at given parameters, with gradients and Hessian."""

    parameters: FloatArray
    """(size,): the population's parameters (`ParameterLayout`); size is their number."""
    cost: float
    """Minus the penalized log marginal likelihood."""
    log_likelihood: float
    """Log marginal likelihood of all persons, without the penalty."""
    scores: FloatArray
    """(n, size): gradient of each person's log marginal likelihood."""
    hessian: FloatArray
    """(size, size): Hessian of the cost."""
    gradient: FloatArray
    """(size,): gradient of the cost."""
    moments: Moments
    """Posterior moments of each person; those that place the next nodes."""
    converged: bool
    """False where a search ended at its largest number of steps."""


class QuadratureSearch:
    """Newton search for the maximum of one objective by quadrature."""

    def __init__(self, objective: Objective) -> None:
        """Prepare the quadrature, and the bounds and longest steps (size,) of the parameters, for an objective."""
        self.objective, self._quadrature = objective, Quadrature(objective.answers, objective.family)
        bounds = [
            (-np.inf if lower is None else lower, np.inf if upper is None else upper)
            for lower, upper in objective.bounds
        ]
        self._lower_bounds, self._upper_bounds = np.array(bounds).T
        self._longest_steps = np.full(len(bounds), LONGEST_STEPS[1])
        self._longest_steps[: objective.layout.k] = LONGEST_STEPS[0]

    def find_maximum(self, parameters: FloatArray) -> QuadratureEvaluation:
        """Find the maximum by fine nodes, or by fixed ones where that search does not converge; `converged` is False
        where neither does. parameters: (size,), maximum by Laplace's method."""
        coarse_minimum = self._search_minimum(self._evaluate_start(parameters, COARSE_COUNTS), COARSE_COUNTS)
        fine_minimum = self._search_minimum(
            self._evaluate(coarse_minimum.parameters, coarse_minimum.moments, FINE_COUNTS), FINE_COUNTS
        )
        if fine_minimum.converged:
            return fine_minimum
        return self._search_minimum(
            self._evaluate(fine_minimum.parameters, fine_minimum.moments, FIXED_COUNTS), FIXED_COUNTS
        )

    def find_lowest_cost(self, parameters: FloatArray, fixed_index: int | None = None) -> float:
        """Find the lowest cost near these parameters (size,) by coarse nodes; where that search does not converge,
        again from the maximum by Laplace's method. fixed_index: index of a parameter that keeps its value."""
        minimum = self._search_minimum(self._evaluate_start(parameters, COARSE_COUNTS), COARSE_COUNTS, fixed_index)
        if not minimum.converged:
            laplace_parameters = maximise(self.objective, parameters, fixed_index).x
            minimum = self._search_minimum(
                self._evaluate_start(laplace_parameters, COARSE_COUNTS), COARSE_COUNTS, fixed_index
            )
        # The quadratic approximation gives the rest of the way to the minimum: half the Newton decrement.
        return minimum.cost + 0.5 * float(minimum.gradient @ self._compute_newton_step(minimum, fixed_index))

    def _evaluate_start(self, parameters: FloatArray, counts: NodeCounts) -> QuadratureEvaluation:
        """Evaluate the cost at the parameters, clipped to their bounds, with nodes placed by Laplace's method."""
        parameters = np.clip(parameters, self._lower_bounds, self._upper_bounds)
        moments = compute_laplace_moments(parameters, *self.objective.marginal.find_modes(parameters))
        return self._evaluate(parameters, moments, counts)

    def _search_minimum(
        self, current: QuadratureEvaluation, counts: NodeCounts, fixed_index: int | None = None
    ) -> QuadratureEvaluation:
        """Minimise the cost by Newton's method from `current` until the decrement is below `LARGEST_DECREMENT`;
        `converged` is False where it is not."""
        for _ in range(MOST_NEWTON_STEPS):
            step = self._compute_newton_step(current, fixed_index)
            if -float(current.gradient @ step) < LARGEST_DECREMENT[counts]:
                return current
            step_fraction = 1.0 / max(1.0, float(np.abs(step / self._longest_steps).max()))
            for _ in range(STEP_ATTEMPTS):
                next_evaluation = self._evaluate(
                    np.clip(current.parameters + step_fraction * step, self._lower_bounds, self._upper_bounds),
                    current.moments,
                    counts,
                )
                if next_evaluation.cost <= current.cost + ACCEPTED_COST_RISE:
                    break
                step_fraction /= 4.0
            else:
                # No step was accepted, because the nodes do not fit the posterior yet: place them anew, by the moments
                # of the last accepted evaluation, without a step.
                next_evaluation = self._evaluate(current.parameters, current.moments, counts)
            current = replace(next_evaluation, moments=current.moments) if counts is FIXED_COUNTS else next_evaluation
        return replace(current, converged=False)

    def _compute_newton_step(self, current: QuadratureEvaluation, fixed_index: int | None) -> FloatArray:
        """Compute the Newton step (size,); 0 for the fixed parameter, and for parameters at a bound that the step would
        cross."""
        is_at_bound = ((current.parameters <= self._lower_bounds) & (current.gradient > 0)) | (
            (current.parameters >= self._upper_bounds) & (current.gradient < 0)
        )
        is_free = (np.arange(len(current.parameters)) != fixed_index) & ~is_at_bound
        eigenvalues, eigenvectors = np.linalg.eigh(current.hessian[np.ix_(is_free, is_free)])
        step = np.zeros(len(current.parameters))
        # Eigenvalues by magnitude: the step lowers the cost also where the curvature is negative.
        step[is_free] = -eigenvectors @ (
            (eigenvectors.T @ current.gradient[is_free]) / np.maximum(np.abs(eigenvalues), LEAST_CURVATURE)
        )
        return step

    def _evaluate(self, parameters: FloatArray, moments: Moments, counts: NodeCounts) -> QuadratureEvaluation:
        """Evaluate the cost with derivatives at the parameters, by nodes placed by the moments."""
        integrals = integrate(self._quadrature, parameters, moments, counts)
        log_prior, prior_gradient = self.objective.evaluate_log_prior(parameters)
        log_likelihood = float(integrals.value.sum())
        return QuadratureEvaluation(
            parameters=parameters,
            cost=-log_likelihood - log_prior,
            log_likelihood=log_likelihood,
            scores=integrals.scores,
            hessian=-integrals.hessian - self.objective.compute_log_prior_hessian(parameters),
            gradient=-integrals.scores.sum(axis=0) - prior_gradient,
            moments=integrals.moments,
            converged=True,
        )
