"""Nodes of the adaptive quadrature: where each person's latent parameters probably lie, by Laplace's method.

Given what a person shares over frequencies (deviation u, log-slope b, criterion c) the thresholds at single frequencies
are independent. So there are outer nodes over u, b and c, and at each of them inner nodes for the threshold of every
frequency. Both are those of Gauss and Hermite's rule, centred and scaled by Laplace's method: person by person, and the
inner ones anew at every outer node.

Source: J. C. Naylor, A. F. M. Smith, J. R. Stat. Soc. C 31 (1982), 214-225; S. Rabe-Hesketh, A. Skrondal, A. Pickles,
J. Econometrics 128 (2005), 301-323 (nested).
"""

import math
from dataclasses import dataclass
from functools import cache
from itertools import product

import numpy as np
from scipy.special import expit

from analysis.psychophysics.hierarchy.marginal import prior_precision
from equalizer.signals.signal import FloatArray


@dataclass(frozen=True, slots=True)
class Counts:
    """Number of nodes of each kind."""

    shared: int
    """Outer, of the deviation u."""
    slope: int
    """Outer, of the log-slope b."""
    criterion: int
    """Outer, of the criterion c."""
    threshold: int
    """Inner, of the threshold at each frequency."""


COARSE, FINE, FIXED = Counts(3, 5, 3, 5), Counts(5, 5, 3, 7), Counts(5, 7, 3, 7)
"""The fine nodes put medians within 0.03 dB of where twice as many of each kind do, also where most are above the cap.
Where they do not settle, because a person's distribution has two maxima, there are more, which keep their places."""


LEAST_SHARE = 1e-4
"""Share of the variance of the nodes themselves that is added to that of the distribution: it is never 0, as it would
be where all weight falls on a single node. By hand."""


@dataclass(frozen=True, slots=True, eq=False)
class Moments:
    """Posterior distribution of each person's latent parameters, as far as nodes need it; n persons, k frequencies."""

    shared: FloatArray
    """(n, 3): means of u, b and c."""
    covariance: FloatArray
    """(n, 3, 3): of these."""
    threshold: FloatArray
    """(n, k): means of the thresholds."""
    regression: FloatArray
    """(n, k, 3): of the thresholds on u, b and c."""
    variance: FloatArray
    """(n, k): of the thresholds at given u, b and c."""


@dataclass(frozen=True, slots=True, eq=False)
class Nodes:
    """n persons, q outer nodes, k frequencies, r inner nodes."""

    shared: FloatArray
    """(n, q, 3): u, b, c."""
    log_weight: FloatArray
    """(n, q)"""
    threshold: FloatArray
    """(n, q, k, r)"""
    log_weight_inside: FloatArray
    """(n, 1, k, r)"""


@dataclass(frozen=True, slots=True)
class Population:
    """The population's parameters (those of a `Layout`), by name and in their own units."""

    means: FloatArray
    """(k,): mean threshold at each frequency, dB."""
    shared_sd: float
    """Between people, of the deviation that a person has at all frequencies, dB."""
    own_sd: float
    """Of a person's further deviation at each single frequency, dB."""
    slope: float
    """Mean of the log-slope b."""
    slope_sd: float
    criterion_sd: float
    """Of the criterion c, in units of d'; its mean is 0."""
    lapse: float
    """Lapse rate, the same for all people."""

    @staticmethod
    def of(parameters: FloatArray, k: int) -> "Population":
        """The population of transformed parameters (k + 6,), in which standard deviations are logarithms and the lapse
        rate is a logit (`marginal.Layout`)."""
        shared, own, slope_sd, criterion_sd = (math.exp(parameters[k + place]) for place in (0, 1, 3, 4))
        lapse = float(expit(parameters[k + 5]))
        return Population(parameters[:k], shared, own, float(parameters[k + 2]), slope_sd, criterion_sd, lapse)


def laplace_moments(parameters: FloatArray, mode: FloatArray, information: FloatArray) -> Moments:
    """Posterior moments of each person by Laplace's method. mode: (n, k + 2), information of the answers there: (n, k +
    2, k + 2)."""
    k = mode.shape[1] - 2
    population, places = Population.of(parameters, k), np.arange(k)
    own, shared = population.own_sd**2, population.shared_sd**2
    # u given all thresholds is normal: its mean is `drawn` times the sum of their deviations.
    rest = 1.0 / (1.0 / shared + k / own)
    drawn = rest / own
    weights = np.zeros((3, k + 2))
    weights[0, :k], weights[1, k], weights[2, k + 1] = drawn, 1.0, 1.0
    covariance = weights @ np.linalg.inv(prior_precision(parameters, k) + information) @ weights.T
    covariance[:, 0, 0] += rest
    middle = mode @ weights.T
    middle[:, 0] -= drawn * population.means.sum()
    variance = 1.0 / (information[:, places, places] + 1.0 / own)
    tied = np.concatenate([np.full((len(mode), k, 1), 1.0 / own), -information[:, :k, k:]], axis=2)
    return Moments(middle, covariance, mode[:, :k], tied * variance[..., None], variance)


def place_nodes(moments: Moments, counts: Counts) -> Nodes:
    """Nodes with log weights for each person: outer nodes for what is shared, inner nodes for each threshold. counts:
    number of nodes by latent number."""
    root = np.linalg.cholesky(moments.covariance)
    places, log_weights = _outer_rule(counts)
    steps = np.einsum("nab,qb->nqa", root, places)
    centre = moments.threshold[:, None] + np.einsum("nka,nqa->nqk", moments.regression, steps)
    inner_places, inner_weights = _rule(counts.threshold)
    sd = np.sqrt(moments.variance)[:, None, :, None]
    return Nodes(
        shared=moments.shared[:, None] + steps,
        log_weight=log_weights + np.log(np.diagonal(root, axis1=1, axis2=2)).sum(axis=1)[:, None],
        threshold=centre[..., None] + sd * inner_places,
        log_weight_inside=inner_weights + np.log(sd),
    )


def weigh_nodes(nodes: Nodes, weight: FloatArray, inside: FloatArray) -> Moments:
    """Moments of the posterior distribution. weight: (n, q), inside: (n, q, k, r), probabilities of the nodes."""
    shared = np.einsum("nq,nqa->na", weight, nodes.shared)
    away = nodes.shared - shared[:, None]
    covariance = np.einsum("nq,nqa,nqb->nab", weight, away, away)
    covariance += LEAST_SHARE * np.einsum("na,ab->nab", nodes.shared.var(axis=1), np.eye(3))
    means = np.einsum("nqkr,nqkr->nqk", inside, nodes.threshold)
    threshold = np.einsum("nq,nqk->nk", weight, means)
    off = means - threshold[:, None]
    regression = np.einsum("nq,nqa,nqk->nka", weight, away, off) @ np.linalg.pinv(covariance, hermitian=True)
    left = off - np.einsum("nka,nqa->nqk", regression, away)
    spread = np.einsum("nqkr,nqkr->nqk", inside, (nodes.threshold - means[..., None]) ** 2)
    variance = np.einsum("nq,nqk->nk", weight, spread + left**2)
    variance += LEAST_SHARE * nodes.threshold.var(axis=3).mean(axis=1)
    return Moments(shared, covariance, threshold, regression, variance)


@cache
def _rule(count: int) -> tuple[FloatArray, FloatArray]:
    """Places, and logarithms of weights that make sums of f / (normal density without 2 pi) into integrals."""
    places, weights = np.polynomial.hermite_e.hermegauss(count)
    return places, np.log(weights / weights.sum()) + places**2 / 2.0


@cache
def _outer_rule(counts: Counts) -> tuple[FloatArray, FloatArray]:
    rules = [list(zip(*_rule(count), strict=True)) for count in (counts.shared, counts.slope, counts.criterion)]
    nodes = list(product(*rules))
    places = np.array([[place for place, _ in node] for node in nodes])
    return places, np.array([sum(weight for _, weight in node) for node in nodes])
