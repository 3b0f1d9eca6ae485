"""Log marginal likelihood of each person by adaptive Gauss-Hermite quadrature, with gradient and Hessian.

Laplace's method (`marginal`) puts medians some 0.13 dB too low, because the likelihood of a threshold is skewed: its
integral is not that of the normal density with the expected information. The nodes are those of `nodes`.

With L the log density of a person's answers and latent parameters z, and E over the posterior distribution of z:
    gradient = E[dL]  (Fisher's identity),      Hessian = E[d²L] + Cov[dL]  (Louis' identity),
so that no derivative of the node positions is needed.

Source: R. A. Fisher, Proc. Camb. Philos. Soc. 22 (1925), 700-725; T. A. Louis, J. R. Stat. Soc. B 44 (1982), 226-233.
"""

import math
from dataclasses import dataclass

import numpy as np
from scipy.special import ndtr

from analysis.psychophysics.hierarchy.answers import Answers
from analysis.psychophysics.hierarchy.curve import AT_THRESHOLD, NEPER_PER_DB, Family, evidence_at
from analysis.psychophysics.hierarchy.marginal import Layout
from analysis.psychophysics.hierarchy.nodes import Counts, Moments, Nodes, Population, place_nodes, weigh_nodes
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


class _Person:
    """A person's answers by run and level, arranged so that the evidence q is computed once per level and node."""

    def __init__(self, answers: Answers, person: int, family: Family) -> None:
        self._family, self._k = family, len(answers.frequencies_hz)
        chosen = answers.person == person
        place, level_db = answers.run[chosen] % self._k, answers.level_db[chosen]
        new = (np.diff(place, prepend=-1) != 0) | (np.diff(level_db, prepend=np.nan) != 0)
        self._place, self._level_db = place[new], level_db[new]
        # An entry per level, shown direction, and right or wrong; only for answers that were given.
        counts = np.stack([answers.right[chosen], answers.wrong[chosen]], axis=1)
        cell, kind = np.nonzero(counts)
        self._count = counts[cell, kind][:, None, None]
        self._level = (np.cumsum(new) - 1)[cell]
        self._side = answers.side[chosen][cell][:, None, None]
        self._sign = np.where(kind == 0, 1.0, -1.0)[:, None, None]
        run = place[cell]
        self._starts = np.flatnonzero(np.diff(run, prepend=-1))
        self._runs = run[self._starts]

    def log_likelihoods(self, shared: FloatArray, threshold: FloatArray, lapse: float) -> FloatArray:
        """(3, q, k, r): log-likelihood of each run, and its first two derivatives by the lapse rate. shared: (q, 3),
        threshold: (q, k, r)."""
        pace = np.exp(shared[:, 1, None]) * NEPER_PER_DB
        away = self._level_db[:, None, None] - threshold[:, self._place].swapaxes(0, 1)
        q = evidence_at(AT_THRESHOLD[self._family] + pace * away, self._family)
        given = ndtr(self._sign * (q[self._level] - self._side * shared[:, 2, None]))
        share = lapse + (1.0 - 2.0 * lapse) * given
        change = (1.0 - 2.0 * given) / share
        terms = np.stack([np.log(share), change, -(change**2)]) * self._count
        out = np.zeros((3, self._k, *away.shape[1:]))
        out[:, self._runs] = np.add.reduceat(terms, self._starts, axis=1)
        return out.swapaxes(1, 2)


class Quadrature:
    """A study's answers, prepared for integrals at many values of the population parameters."""

    def __init__(self, answers: Answers, family: Family) -> None:
        self.k, self.people = len(answers.frequencies_hz), answers.persons
        self._persons = [_Person(answers, person, family) for person in range(answers.persons)]

    def log_likelihoods(self, nodes: Nodes, lapse: float) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Log-likelihood of each run, and its first two derivatives by the logit of the lapse rate, (n, q, k, r)
        each."""
        parts = zip(self._persons, nodes.shared, nodes.threshold, strict=True)
        each = [person.log_likelihoods(shared, threshold, lapse) for person, shared, threshold in parts]
        value, first, second = np.stack(each, axis=1)
        slope = lapse * (1.0 - lapse)
        return value, slope * first, slope**2 * second + slope * (1.0 - 2.0 * lapse) * first


def integrate(quadrature: Quadrature, parameters: FloatArray, moments: Moments, counts: Counts) -> Integrals:
    """Log marginal likelihoods and derivatives at the parameters (size,) of `Layout`. moments: posterior moments at
    these parameters, or at parameters close to them. counts: number of nodes."""
    k = quadrature.k
    population = Population.of(parameters, k)
    nodes = place_nodes(moments, counts)
    likelihood, by_lapse, by_lapse_twice = quadrature.log_likelihoods(nodes, population.lapse)
    u, b, c = np.moveaxis(nodes.shared, 2, 0)
    e = (nodes.threshold - population.means[:, None] - u[..., None, None]) / population.own_sd
    height, inside = _normalise(nodes.log_weight_inside + likelihood - 0.5 * e**2)
    deviations = np.stack([
        u / population.shared_sd, (b - population.slope) / population.slope_sd, c / population.criterion_sd
    ], axis=-1)  # fmt: skip
    outer = nodes.log_weight + height.sum(axis=2) - 0.5 * (deviations**2).sum(axis=2)
    value, weight = _normalise(outer)
    value -= k * math.log(population.own_sd) + math.log(
        population.shared_sd * population.slope_sd * population.criterion_sd
    )
    known = np.stack([e / population.own_sd, e**2 - 1.0, by_lapse], axis=-1)
    mean = np.einsum("nqkr,nqkrs->nqks", inside, known)
    square = np.einsum("nqkr,nqkrs,nqkrt->nqkst", inside, known, known, optimize=True)
    covariance = np.einsum("nq,nqkst->kst", weight, square - mean[..., :, None] * mean[..., None, :])
    bent = float(np.einsum("nq,nqkr,nqkr->", weight, inside, by_lapse_twice, optimize=True))
    gradient = _gradient(mean, deviations, population)
    scores = np.einsum("nq,nqs->ns", weight, gradient)
    hessian = np.einsum("nq,nqs,nqt->st", weight, gradient, gradient, optimize=True) - scores.T @ scores
    hessian += _covariance_inside(covariance) + _hessian_known(scores, bent, population, quadrature.people)
    return Integrals(value, scores, hessian, weigh_nodes(nodes, weight, inside))


def _normalise(log_terms: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Logarithm of the sum over the last axis, and each term's share of it."""
    high = log_terms.max(axis=-1, keepdims=True)
    shares = np.exp(log_terms - high)
    total = shares.sum(axis=-1, keepdims=True)
    return (np.log(total) + high)[..., 0], shares / total


def _gradient(mean: FloatArray, deviations: FloatArray, population: Population) -> FloatArray:
    """(n, q, size): gradient of L at the outer nodes, averaged over the inner nodes. mean: (n, q, k, 3), averages by
    mean, log SD and lapse rate; deviations: (n, q, 3), of u, b and c in standard deviations."""
    layout = Layout(mean.shape[2])
    out = np.empty((*mean.shape[:2], layout.size))
    out[..., : layout.k] = mean[..., 0]
    out[..., layout.k + 1], out[..., layout.lapse] = mean[..., 1].sum(axis=2), mean[..., 2].sum(axis=2)
    out[..., layout.slope] = deviations[..., 1] / population.slope_sd
    out[..., [layout.k, layout.k + 3, layout.k + 4]] = deviations**2 - 1.0
    return out


def _covariance_inside(covariance: FloatArray) -> FloatArray:
    """Covariance of the gradient within outer nodes (size, size), from the covariances (k, 3, 3) by mean, log SD and
    lapse rate at each frequency: thresholds at different frequencies are independent there."""
    layout = Layout(len(covariance))
    places, summed = np.arange(layout.k), covariance.sum(axis=0)
    out = np.zeros((layout.size, layout.size))
    out[places, places] = covariance[:, 0, 0]
    for row, place in ((1, layout.k + 1), (2, layout.lapse)):
        out[places, place] = out[place, places] = covariance[:, 0, row]
        out[place, place] = summed[row, row]
    out[layout.k + 1, layout.lapse] = out[layout.lapse, layout.k + 1] = summed[1, 2]
    return out


def _hessian_known(scores: FloatArray, bent: float, population: Population, persons: int) -> FloatArray:
    """(size, size): posterior mean of the Hessian of L, summed over persons. It follows from the gradient, because the
    population densities are normal. bent: second derivative by the logit of the lapse rate."""
    layout, total = Layout(len(population.means)), scores.sum(axis=0)
    out = np.zeros((layout.size, layout.size))
    places = np.arange(layout.k)
    out[places, places] = -persons / population.own_sd**2
    out[places, layout.k + 1] = out[layout.k + 1, places] = -2.0 * total[: layout.k]
    out[layout.slope, layout.slope] = -persons / population.slope_sd**2
    out[layout.slope, layout.k + 3] = out[layout.k + 3, layout.slope] = -2.0 * total[layout.slope]
    for place, terms in ((layout.k, 1), (layout.k + 1, layout.k), (layout.k + 3, 1), (layout.k + 4, 1)):
        out[place, place] = -2.0 * (total[place] + persons * terms)
    out[layout.lapse, layout.lapse] = bent
    return out
