"""Nodes and weights of adaptive Gauss-Hermite quadrature over each person's latent parameters.

Given the parameters that a person shares over all frequencies (deviation u, log-slope b, criterion c), the thresholds
at single frequencies are independent. The quadrature is therefore nested: outer nodes over u, b and c, and at each of
them inner nodes over the threshold at every frequency. Nodes are centred and scaled for each person by the posterior
moments, first from Laplace's method, then from an earlier evaluation; inner nodes are centred by the regression of the
thresholds on u, b and c.

Source: J. C. Naylor, A. F. M. Smith, J. R. Stat. Soc. C 31 (1982), 214-225; S. Rabe-Hesketh, A. Skrondal, A. Pickles,
J. Econometrics 128 (2005), 301-323 (nested).
"""

import math
from dataclasses import dataclass
from functools import cache
from itertools import product

import numpy as np
from scipy.special import expit

from analysis.psychophysics.hierarchy.marginal import compute_prior_precision
from equalizer.signals.signal import FloatArray


@dataclass(frozen=True, slots=True)
class NodeCounts:
    """Number of nodes per latent parameter."""

    shared: int
    """Outer, of the deviation u."""
    slope: int
    """Outer, of the log-slope b."""
    criterion: int
    """Outer, of the criterion c."""
    threshold: int
    """Inner, of the threshold at each frequency."""


COARSE_COUNTS, FINE_COUNTS, FIXED_COUNTS = NodeCounts(3, 5, 3, 5), NodeCounts(5, 5, 3, 7), NodeCounts(5, 7, 3, 7)
"""Numbers of nodes, chosen. With FINE, medians are within 0.03 dB of those with twice as many of each kind, also where
most are above the cap. FIXED has more nodes, at fixed positions, for searches that do not converge with FINE because a
person's posterior has two maxima."""


ADDED_VARIANCE_SHARE = 1e-4
"""Share of the variance of the node positions that is added to the posterior variance, which would be 0 where all
weight is on a single node. Chosen: small against the variance itself."""


@dataclass(frozen=True, slots=True, eq=False)
class Moments:
    """Posterior moments of each person's latent parameters that place the nodes; n persons, k frequencies."""

    shared_means: FloatArray
    """(n, 3): means of u, b and c."""
    covariance: FloatArray
    """(n, 3, 3): covariance of u, b and c."""
    threshold_means: FloatArray
    """(n, k): means of the thresholds, dB."""
    regression: FloatArray
    """(n, k, 3): regression coefficients of the thresholds on u, b and c."""
    threshold_variances: FloatArray
    """(n, k): variances of the thresholds at given u, b and c, dB²."""


@dataclass(frozen=True, slots=True, eq=False)
class Nodes:
    """Positions and log weights of the nodes: n persons, q outer nodes, k frequencies, r inner nodes."""

    outer_positions: FloatArray
    """(n, q, 3): outer nodes, u (dB), b and c (d')."""
    outer_log_weight: FloatArray
    """(n, q): of the outer nodes."""
    inner_positions: FloatArray
    """(n, q, k, r): inner nodes, dB."""
    inner_log_weight: FloatArray
    """(n, 1, k, r): of the inner nodes, the same at every outer node."""


@dataclass(frozen=True, slots=True)
class PopulationParameters:
    """The population's parameters (those of a `ParameterLayout`), by name and in their own units."""

    means: FloatArray
    """(k,): mean threshold at each frequency, dB."""
    shared_sd: float
    """Standard deviation between people of the deviation u that a person has at all frequencies, dB."""
    interaction_sd: float
    """Standard deviation of a person's further deviation at each single frequency, dB."""
    slope: float
    """Mean of the log-slope b."""
    slope_sd: float
    """Standard deviation of the log-slope b."""
    criterion_sd: float
    """Standard deviation of the criterion c, in units of d'; its mean is 0."""
    lapse: float
    """Lapse rate, the same for all people."""

    @staticmethod
    def from_parameters(parameters: FloatArray, k: int) -> "PopulationParameters":
        """Make the population of transformed parameters (k + 6,), in which standard deviations are logarithms and the
        lapse rate is a logit (`marginal.ParameterLayout`)."""
        shared_sd, interaction_sd, slope_sd, criterion_sd = (
            math.exp(parameters[k + offset]) for offset in (0, 1, 3, 4)
        )
        lapse = float(expit(parameters[k + 5]))
        return PopulationParameters(
            parameters[:k], shared_sd, interaction_sd, float(parameters[k + 2]), slope_sd, criterion_sd, lapse
        )


def compute_laplace_moments(parameters: FloatArray, mode: FloatArray, information: FloatArray) -> Moments:
    """Compute the posterior moments of each person by Laplace's method. parameters: (k + 6,), of the population, as for
    `PopulationParameters.from_parameters`. mode: (n, k + 2), posterior mode; information: (n, k + 2, k + 2), expected
    information of the answers there."""
    k = mode.shape[1] - 2
    population, frequency_index = PopulationParameters.from_parameters(parameters, k), np.arange(k)
    interaction_variance, shared_variance = population.interaction_sd**2, population.shared_sd**2
    # Given all thresholds, u is normal: its mean is `u_weight` times the sum of their deviations from the population
    # means, its variance is `u_variance`. `shared_projection` maps thresholds, b and c to u, b and c.
    u_variance = 1.0 / (1.0 / shared_variance + k / interaction_variance)
    u_weight = u_variance / interaction_variance
    shared_projection = np.zeros((3, k + 2))
    shared_projection[0, :k], shared_projection[1, k], shared_projection[2, k + 1] = u_weight, 1.0, 1.0
    covariance = (
        shared_projection @ np.linalg.inv(compute_prior_precision(parameters, k) + information) @ shared_projection.T
    )
    covariance[:, 0, 0] += u_variance
    shared_means = mode @ shared_projection.T
    shared_means[:, 0] -= u_weight * population.means.sum()
    threshold_variances = 1.0 / (information[:, frequency_index, frequency_index] + 1.0 / interaction_variance)
    scaled_regression = np.concatenate(
        [np.full((len(mode), k, 1), 1.0 / interaction_variance), -information[:, :k, k:]], axis=2
    )
    return Moments(
        shared_means, covariance, mode[:, :k], scaled_regression * threshold_variances[..., None], threshold_variances
    )


def place_nodes(moments: Moments, counts: NodeCounts) -> Nodes:
    """Place nodes with log weights for each person: outer nodes for u, b and c, inner nodes for each threshold, both
    scaled by the moments."""
    cholesky = np.linalg.cholesky(moments.covariance)
    outer_standard_positions, outer_log_weights = _make_product_rule(counts)
    deviations = np.einsum("nab,qb->nqa", cholesky, outer_standard_positions)
    threshold_centre_db = moments.threshold_means[:, None] + np.einsum("nka,nqa->nqk", moments.regression, deviations)
    inner_standard_positions, inner_log_weights = _make_gauss_hermite_rule(counts.threshold)
    threshold_sd_db = np.sqrt(moments.threshold_variances)[:, None, :, None]
    return Nodes(
        outer_positions=moments.shared_means[:, None] + deviations,
        outer_log_weight=outer_log_weights + np.log(np.diagonal(cholesky, axis1=1, axis2=2)).sum(axis=1)[:, None],
        inner_positions=threshold_centre_db[..., None] + threshold_sd_db * inner_standard_positions,
        inner_log_weight=inner_log_weights + np.log(threshold_sd_db),
    )


def compute_posterior_moments(nodes: Nodes, outer_weight: FloatArray, inner_weight: FloatArray) -> Moments:
    """Compute the posterior moments as weighted sums over the nodes. outer_weight: (n, q), posterior probabilities of
    the outer nodes; inner_weight: (n, q, k, r), those of the inner nodes at each outer node."""
    shared_means = np.einsum("nq,nqa->na", outer_weight, nodes.outer_positions)
    outer_deviation = nodes.outer_positions - shared_means[:, None]
    covariance = np.einsum("nq,nqa,nqb->nab", outer_weight, outer_deviation, outer_deviation)
    covariance += ADDED_VARIANCE_SHARE * np.einsum("na,ab->nab", nodes.outer_positions.var(axis=1), np.eye(3))
    inner_means = np.einsum("nqkr,nqkr->nqk", inner_weight, nodes.inner_positions)
    threshold_means = np.einsum("nq,nqk->nk", outer_weight, inner_means)
    threshold_deviation = inner_means - threshold_means[:, None]
    regression = np.einsum("nq,nqa,nqk->nka", outer_weight, outer_deviation, threshold_deviation) @ np.linalg.pinv(
        covariance, hermitian=True
    )
    residual = threshold_deviation - np.einsum("nka,nqa->nqk", regression, outer_deviation)
    inner_variance = np.einsum("nqkr,nqkr->nqk", inner_weight, (nodes.inner_positions - inner_means[..., None]) ** 2)
    threshold_variances = np.einsum("nq,nqk->nk", outer_weight, inner_variance + residual**2)
    threshold_variances += ADDED_VARIANCE_SHARE * nodes.inner_positions.var(axis=3).mean(axis=1)
    return Moments(shared_means, covariance, threshold_means, regression, threshold_variances)


@cache
def _make_gauss_hermite_rule(count: int) -> tuple[FloatArray, FloatArray]:
    """Make Gauss-Hermite positions x and log weights log(w / sum of w) + x² / 2, (count,) each: the sum of exp(log
    weight) f(x) is the integral of f over the real line, divided by sqrt(2 pi), the constant of the normal prior
    densities."""
    positions, weights = np.polynomial.hermite_e.hermegauss(count)
    return positions, np.log(weights / weights.sum()) + positions**2 / 2.0


@cache
def _make_product_rule(counts: NodeCounts) -> tuple[FloatArray, FloatArray]:
    """Make the product rule over u, b and c: standard positions (q, 3) and log weights (q,)."""
    axis_rules = [
        list(zip(*_make_gauss_hermite_rule(count), strict=True))
        for count in (counts.shared, counts.slope, counts.criterion)
    ]
    product_nodes = list(product(*axis_rules))
    positions = np.array([[position for position, _ in node] for node in product_nodes])
    return positions, np.array([sum(log_weight for _, log_weight in node) for node in product_nodes])
