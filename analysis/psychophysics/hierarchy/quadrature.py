"""Log marginal likelihood of each person by adaptive Gauss-Hermite quadrature, with gradient and Hessian.

Laplace's method (`marginal`) puts medians some 0.13 dB too low (docs/statistics.md), because the likelihood of a
threshold is skewed: its integral is not that of the normal density with the expected information. The nodes are those
of `nodes`.

With L the log density of a person's answers and latent parameters z, and E over the posterior distribution of z:
    gradient = E[dL]  (Fisher's identity),      Hessian = E[d²L] + Cov[dL]  (Louis' identity),
so that no derivative of the node positions is needed.

Axes of arrays: n persons, q outer nodes (over u, the person's common deviation in dB, the log-slope b and the criterion
c), k frequencies, r inner nodes (over the threshold at a frequency).

Source: R. A. Fisher, Proc. Camb. Philos. Soc. 22 (1925), 700-725; T. A. Louis, J. R. Stat. Soc. B 44 (1982), 226-233.
"""

import math
from dataclasses import dataclass

import numpy as np
from scipy.special import ndtr

from analysis.psychophysics.hierarchy.answers import Answers
from analysis.psychophysics.hierarchy.curve import NEPER_PER_DB, T_AT_THRESHOLD, Family, compute_mean_evidence
from analysis.psychophysics.hierarchy.marginal import ParameterLayout
from analysis.psychophysics.hierarchy.nodes import (
    Moments,
    NodeCounts,
    Nodes,
    PopulationParameters,
    compute_posterior_moments,
    place_nodes,
)
from equalizer.signals.signal import FloatArray


@dataclass(frozen=True, slots=True, eq=False)
class Integrals:
    """Log marginal likelihoods of n persons, their gradients, and the Hessian of their sum."""

    value: FloatArray
    """(n,): log marginal likelihood."""
    scores: FloatArray
    """(n, size): its gradient."""
    hessian: FloatArray
    """(size, size): Hessian of the sum of the values over persons."""
    moments: Moments
    """Posterior moments by these nodes, to place the nodes of the next evaluation."""


class _PersonAnswers:
    """A person's answers by run and level, arranged so that the evidence q is computed once per level and node."""

    def __init__(self, answers: Answers, person: int, family: Family) -> None:
        self._family, self._k = family, len(answers.frequencies_hz)
        is_person = answers.person == person
        frequency_index, level_db = answers.run[is_person] % self._k, answers.level_db[is_person]
        starts_level = (np.diff(frequency_index, prepend=-1) != 0) | (np.diff(level_db, prepend=np.nan) != 0)
        self._frequency_index, self._level_db = frequency_index[starts_level], level_db[starts_level]
        # An entry per level, shown direction, and right or wrong; only for answers that were given.
        counts = np.stack([answers.right[is_person], answers.wrong[is_person]], axis=1)
        cell, outcome = np.nonzero(counts)
        self._count = counts[cell, outcome][:, None, None]
        self._level = (np.cumsum(starts_level) - 1)[cell]
        self._side = answers.side[is_person][cell][:, None, None]
        self._sign = np.where(outcome == 0, 1.0, -1.0)[:, None, None]
        frequency_of_entry = frequency_index[cell]
        self._starts = np.flatnonzero(np.diff(frequency_of_entry, prepend=-1))
        self._runs = frequency_of_entry[self._starts]

    def compute_log_likelihoods(self, shared: FloatArray, threshold: FloatArray, lapse: float) -> FloatArray:
        """Compute (3, q, k, r): log-likelihood of each run, and its first two derivatives by the lapse rate. shared:
        (q, 3), nodes of u, b and c; threshold: (q, k, r), nodes in dB."""
        slope_per_db = np.exp(shared[:, 1, None]) * NEPER_PER_DB
        above_db = self._level_db[:, None, None] - threshold[:, self._frequency_index].swapaxes(0, 1)
        q = compute_mean_evidence(T_AT_THRESHOLD[self._family] + slope_per_db * above_db, self._family)
        attentive_p = ndtr(self._sign * (q[self._level] - self._side * shared[:, 2, None]))
        answer_p = lapse + (1.0 - 2.0 * lapse) * attentive_p
        by_lapse = (1.0 - 2.0 * attentive_p) / answer_p
        terms = np.stack([np.log(answer_p), by_lapse, -(by_lapse**2)]) * self._count
        sums = np.zeros((3, self._k, *above_db.shape[1:]))
        sums[:, self._runs] = np.add.reduceat(terms, self._starts, axis=1)
        return sums.swapaxes(1, 2)


class Quadrature:
    """A study's answers, prepared for integrals at many values of the population parameters."""

    def __init__(self, answers: Answers, family: Family) -> None:
        self.k, self.people = len(answers.frequencies_hz), answers.persons
        self._persons = [_PersonAnswers(answers, person, family) for person in range(answers.persons)]

    def compute_log_likelihoods(self, nodes: Nodes, lapse: float) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Compute the log-likelihood of each run, and its first two derivatives by the logit of the lapse rate, (n, q,
        k, r) each."""
        node_sets = zip(self._persons, nodes.outer_positions, nodes.inner_positions, strict=True)
        by_person = [
            person.compute_log_likelihoods(shared, threshold, lapse) for person, shared, threshold in node_sets
        ]
        value, first, second = np.stack(by_person, axis=1)
        lapse_slope = lapse * (1.0 - lapse)
        return value, lapse_slope * first, lapse_slope**2 * second + lapse_slope * (1.0 - 2.0 * lapse) * first


def integrate(quadrature: Quadrature, parameters: FloatArray, moments: Moments, counts: NodeCounts) -> Integrals:
    """Compute log marginal likelihoods and derivatives at the parameters (size,) of `ParameterLayout`. moments:
    posterior moments at these parameters, or at parameters close to them. counts: number of nodes."""
    k = quadrature.k
    population = PopulationParameters.from_parameters(parameters, k)
    nodes = place_nodes(moments, counts)
    likelihood, logit_slope, logit_curvature = quadrature.compute_log_likelihoods(nodes, population.lapse)
    u, b, c = np.moveaxis(nodes.outer_positions, 2, 0)
    e = (nodes.inner_positions - population.means[:, None] - u[..., None, None]) / population.interaction_sd
    inner_integral, inner_weight = _normalise(nodes.inner_log_weight + likelihood - 0.5 * e**2)
    deviations = np.stack([
        u / population.shared_sd, (b - population.slope) / population.slope_sd, c / population.criterion_sd
    ], axis=-1)  # fmt: skip
    outer_terms = nodes.outer_log_weight + inner_integral.sum(axis=2) - 0.5 * (deviations**2).sum(axis=2)
    value, weight = _normalise(outer_terms)
    value -= k * math.log(population.interaction_sd) + math.log(
        population.shared_sd * population.slope_sd * population.criterion_sd
    )
    gradient_terms = np.stack([e / population.interaction_sd, e**2 - 1.0, logit_slope], axis=-1)
    mean = np.einsum("nqkr,nqkrs->nqks", inner_weight, gradient_terms)
    square = np.einsum("nqkr,nqkrs,nqkrt->nqkst", inner_weight, gradient_terms, gradient_terms, optimize=True)
    covariance = np.einsum("nq,nqkst->kst", weight, square - mean[..., :, None] * mean[..., None, :])
    lapse_curvature = float(np.einsum("nq,nqkr,nqkr->", weight, inner_weight, logit_curvature, optimize=True))
    gradient = _assemble_gradient(mean, deviations, population)
    scores = np.einsum("nq,nqs->ns", weight, gradient)
    hessian = np.einsum("nq,nqs,nqt->st", weight, gradient, gradient, optimize=True) - scores.T @ scores
    hessian += _assemble_within_node_covariance(covariance) + _compute_mean_hessian(
        scores, lapse_curvature, population, quadrature.people
    )
    return Integrals(value, scores, hessian, compute_posterior_moments(nodes, weight, inner_weight))


def _normalise(log_terms: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Compute log-sum-exp over the last axis, and the softmax: each term's share of the sum."""
    maximum = log_terms.max(axis=-1, keepdims=True)
    shares = np.exp(log_terms - maximum)
    total = shares.sum(axis=-1, keepdims=True)
    return (np.log(total) + maximum)[..., 0], shares / total


def _assemble_gradient(mean: FloatArray, deviations: FloatArray, population: PopulationParameters) -> FloatArray:
    """Assemble the gradient of L at the outer nodes, (n, q, size), averaged over the inner nodes. mean: (n, q, k, 3),
    averages by mean, log SD and lapse rate; deviations: (n, q, 3), of u, b and c in standard deviations."""
    layout = ParameterLayout(mean.shape[2])
    gradient = np.empty((*mean.shape[:2], layout.size))
    gradient[..., : layout.k] = mean[..., 0]
    gradient[..., layout.k + 1], gradient[..., layout.lapse] = mean[..., 1].sum(axis=2), mean[..., 2].sum(axis=2)
    gradient[..., layout.slope] = deviations[..., 1] / population.slope_sd
    gradient[..., [layout.k, layout.k + 3, layout.k + 4]] = deviations**2 - 1.0
    return gradient


def _assemble_within_node_covariance(covariance: FloatArray) -> FloatArray:
    """Assemble the covariance of the gradient within outer nodes, (size, size), from the covariances (k, 3, 3) by mean,
    log SD and lapse rate at each frequency: thresholds at different frequencies are independent there."""
    layout = ParameterLayout(len(covariance))
    index, total = np.arange(layout.k), covariance.sum(axis=0)
    hessian = np.zeros((layout.size, layout.size))
    hessian[index, index] = covariance[:, 0, 0]
    for row, parameter in ((1, layout.k + 1), (2, layout.lapse)):
        hessian[index, parameter] = hessian[parameter, index] = covariance[:, 0, row]
        hessian[parameter, parameter] = total[row, row]
    hessian[layout.k + 1, layout.lapse] = hessian[layout.lapse, layout.k + 1] = total[1, 2]
    return hessian


def _compute_mean_hessian(
    scores: FloatArray, lapse_curvature: float, population: PopulationParameters, persons: int
) -> FloatArray:
    """Compute the posterior mean of the Hessian of L, (size, size), summed over persons. It follows from the gradient,
    because the population densities are normal. lapse_curvature: second derivative by the logit of the lapse rate."""
    layout, total = ParameterLayout(len(population.means)), scores.sum(axis=0)
    hessian = np.zeros((layout.size, layout.size))
    index = np.arange(layout.k)
    hessian[index, index] = -persons / population.interaction_sd**2
    hessian[index, layout.k + 1] = hessian[layout.k + 1, index] = -2.0 * total[: layout.k]
    hessian[layout.slope, layout.slope] = -persons / population.slope_sd**2
    hessian[layout.slope, layout.k + 3] = hessian[layout.k + 3, layout.slope] = -2.0 * total[layout.slope]
    for parameter, terms in ((layout.k, 1), (layout.k + 1, layout.k), (layout.k + 3, 1), (layout.k + 4, 1)):
        hessian[parameter, parameter] = -2.0 * (total[parameter] + persons * terms)
    hessian[layout.lapse, layout.lapse] = lapse_curvature
    return hessian
