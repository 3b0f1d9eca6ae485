"""From the maximum by Laplace's method to the maximum by quadrature, with Newton's method and the exact Hessian."""

from dataclasses import dataclass, replace

import numpy as np

from analysis.psychophysics.hierarchy.nodes import COARSE, FINE, FINEST, Counts, Moments, laplace_moments
from analysis.psychophysics.hierarchy.objective import Objective
from analysis.psychophysics.hierarchy.quadrature import Quadrature, integrate
from equalizer.signals.signal import FloatArray

NEWTON_STEPS = 10
SETTLED = {COARSE: 0.1, FINE: 1e-3, FINEST: 1e-3}
"""Twice the gain in log-likelihood that the next step would bring: 0.001 is a thirtieth of a standard error, and the
step before it was that of a quadratic function already."""
LONGEST_STEP = 2.0, 0.5
"""In a mean (dB), and in all logarithms."""
LEAST_CURVATURE = 1e-3
"""Of a Newton step: below it its length is undetermined."""
SAME_HEIGHT = 0.03
"""Nodes move from step to step: log-likelihoods closer than this are equal."""
SHORTER = 3
"""Attempts with shorter steps."""


@dataclass(frozen=True, slots=True, eq=False)
class Refined:
    numbers: FloatArray
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


def refine(objective: Objective, numbers: FloatArray, held: int | None = None) -> Refined:
    """numbers: where the search by Laplace's method ended. held: a parameter that keeps its value (profile)."""
    quadrature = Quadrature(objective.answers, objective.family)
    moments = laplace_moments(numbers, *objective.marginal.centres(numbers))
    for counts in (COARSE, FINE, FINEST):
        if counts is FINEST and found.converged:
            break
        begin = _evaluate(objective, quadrature, numbers, moments, counts)
        found = _climb(objective, quadrature, begin, counts, held)
        numbers, moments = found.numbers, found.moments
    return found


def _climb(objective: Objective, quadrature: Quadrature, at: Refined, counts: Counts, held: int | None) -> Refined:
    lower, upper = np.array([(-np.inf if a is None else a, np.inf if b is None else b) for a, b in objective.bounds]).T
    longest = np.full(len(at.numbers), LONGEST_STEP[1])
    longest[: objective.layout.k] = LONGEST_STEP[0]
    for _ in range(NEWTON_STEPS):
        step = _newton_step(at, held)
        if -float(at.slope @ step) < SETTLED[counts]:
            return at
        share = 1.0 / max(1.0, float(np.abs(step / longest).max()))
        for _ in range(SHORTER):
            numbers = np.clip(at.numbers + share * step, lower, upper)
            then = _evaluate(objective, quadrature, numbers, at.moments, counts)
            if then.cost <= at.cost + SAME_HEIGHT:
                break
            share /= 4.0
        else:
            # The nodes were not yet where the person is: again, with those that this evaluation has found.
            then = _evaluate(objective, quadrature, at.numbers, at.moments, counts)
        at = replace(then, moments=at.moments) if counts is FINEST else then
    return replace(at, converged=False)


def _newton_step(at: Refined, held: int | None) -> FloatArray:
    free = np.arange(len(at.numbers)) != held
    curvature = at.curvature[np.ix_(free, free)]
    values, vectors = np.linalg.eigh(curvature)
    step = np.zeros(len(at.numbers))
    # Uphill where the curvature says so, and as far as its size says where it is of the wrong sign.
    step[free] = -vectors @ ((vectors.T @ at.slope[free]) / np.maximum(np.abs(values), LEAST_CURVATURE))
    return step


def _evaluate(
    objective: Objective, quadrature: Quadrature, numbers: FloatArray, moments: Moments, counts: Counts
) -> Refined:
    found = integrate(quadrature, numbers, moments, counts)
    penalty, slope = objective.penalty(numbers)
    value = float(found.value.sum())
    return Refined(
        numbers=numbers,
        cost=-value - penalty,
        log_likelihood=value,
        scores=found.scores,
        curvature=-found.hessian - objective.penalty_hessian(numbers),
        slope=-found.scores.sum(axis=0) - slope,
        moments=found.moments,
        converged=True,
    )
