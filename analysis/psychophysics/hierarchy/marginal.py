"""Marginal likelihood of each person in the hierarchical psychometric model, by Laplace's method, and its gradient.

Population: theta = mean_j + person + person x frequency, both normal; log-slope normal; criterion normal around 0; one
lapse rate. Its parameters, in this order (`Layout`): the k means in dB, log SD of persons, log SD of person x
frequency, mean log-slope, log SD of log-slopes, log SD of criteria, logit of the lapse rate.

With the mode z of a person's latent parameters, d = z - centre, prior precision P, expected information J:
    log marginal = log-likelihood(z) - d' P d / 2 + (ln det P - ln det(P + J)) / 2.
J replaces the observed curvature, which can vanish at the mode of a run with a lapse: the volume would be infinite.

Adaptive levels need no correction: each level follows from the answers before it by a fixed rule, so that the design is
ignorable (D. B. Rubin, Biometrika 63 (1976), 581-592). Answers at the cap count as answers at that level, uncensored.

Source: L. Tierney, J. B. Kadane, J. Am. Stat. Assoc. 81 (1986), 82-86; the gradient by implicit differentiation of the
mode: H. J. Skaug, D. A. Fournier, Comput. Stat. Data Anal. 51 (2006), 699-709.
"""

import math
from dataclasses import dataclass

import numpy as np
from scipy.special import expit

from analysis.psychophysics.hierarchy.likelihood import Derivatives, TrialLikelihood
from equalizer.signals.signal import FloatArray

NEWTON_STEPS = 60
"""Maximum number of Newton steps to the mode of a person's latent parameters."""
SETTLED = 1e-11
"""Newton decrement (gradient times step) of the log posterior at which a mode is found; the gradient of the marginal
likelihood then has some six correct digits."""
LOWEST_CURVATURE = 1e-5
"""Least eigenvalue of the observed curvature (per dB²) that is used for a Newton step. A prior SD of 30 dB, with no
answers, has a curvature of 1e-3, well above it."""
LONGEST_STEP_DB, LONGEST_STEP_SLOPE, LONGEST_STEP_D = 6.0, 0.7, 1.0
"""Largest Newton step in a threshold (dB), a log-slope and a criterion (units of d'): over larger steps the log
posterior is not quadratic."""


@dataclass(frozen=True, slots=True)
class Layout:
    """Indices of the population's parameters in their vector (k + 6,), for k frequencies."""

    k: int
    """Number of frequencies; the means are parameters 0 to k - 1."""

    @property
    def size(self) -> int:
        """Number of parameters."""
        return self.k + 6

    @property
    def log_sds(self) -> list[int]:
        """Indices of the log standard deviations: of persons, of person x frequency, of log-slopes, of criteria."""
        return [self.k, self.k + 1, self.k + 3, self.k + 4]

    @property
    def slope(self) -> int:
        """Index of the mean log-slope."""
        return self.k + 2

    @property
    def lapse(self) -> int:
        """Index of the logit of the lapse rate."""
        return self.k + 5


class Marginal:
    """Marginal likelihood of n persons. The last modes, `latent` (n, k + 2), are kept as the start of the next
    search."""

    def __init__(self, likelihood: TrialLikelihood, latent: FloatArray) -> None:
        self.likelihood, self.latent = likelihood, latent
        self.layout = Layout(likelihood.frequencies)
        self._longest = np.array([LONGEST_STEP_DB] * likelihood.frequencies + [LONGEST_STEP_SLOPE, LONGEST_STEP_D])

    def evaluate(self, parameters: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Log marginal likelihood of each person (n,), and its gradient (n, size). parameters: (size,)."""
        layout, k = self.layout, self.layout.k
        precision, centre = prior_precision(parameters, k), _centre(parameters, k)
        lapse = float(expit(parameters[layout.lapse]))
        found = self._find_modes(precision, centre, lapse)
        deviation = self.latent - centre
        inverse = np.linalg.inv(precision + found.information).astype(np.float64)
        by_latent, by_lapse = self.likelihood.trace_derivatives(self.latent, lapse, inverse)
        # The sensitivity of the mode depends on the observed curvature; the volume uses the expected one.
        adjoint = np.linalg.solve(precision - found.second, by_latent[..., None])[..., 0]
        weighted_deviation = deviation @ precision
        value = (
            found.value
            - 0.5 * np.einsum("na,na->n", deviation, weighted_deviation)
            + 0.5 * np.linalg.slogdet(precision)[1]
            + 0.5 * np.linalg.slogdet(inverse)[1]
        )
        scores = np.empty((len(value), layout.size))
        by_centre = weighted_deviation - 0.5 * adjoint @ precision
        scores[:, :k], scores[:, layout.slope] = by_centre[:, :k], by_centre[:, k]
        for place, change, log_det in _precision_derivatives(parameters, k):
            moved = deviation @ change
            scores[:, place] = (
                -0.5 * np.einsum("na,na->n", deviation, moved)
                + 0.5 * log_det
                - 0.5 * np.einsum("nab,ab->n", inverse, change)
                + 0.5 * np.einsum("na,na->n", adjoint, moved)
            )
        scores[:, layout.lapse] = (lapse * (1.0 - lapse)) * (
            found.by_lapse - 0.5 * by_lapse - 0.5 * np.einsum("na,na->n", adjoint, found.first_by_lapse)
        )
        return value, scores

    def centres(self, parameters: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Mode of each person (n, k + 2), and the expected information of the answers there (n, k + 2, k + 2)."""
        k, lapse = self.layout.k, float(expit(parameters[self.layout.lapse]))
        found = self._find_modes(prior_precision(parameters, k), _centre(parameters, k), lapse)
        return self.latent, found.information

    def _find_modes(self, precision: FloatArray, centre: FloatArray, lapse: float) -> Derivatives:
        """Newton's method for all persons at once; a step that lowers a person's log posterior is divided by 3."""
        latent = self.latent.copy()
        now = self.likelihood.evaluate(latent, lapse)
        height = _log_posterior(now, latent - centre, precision)
        for _ in range(NEWTON_STEPS):
            slope = now.first - (latent - centre) @ precision
            step = np.linalg.solve(
                _positive_curvature(precision - now.second, precision + now.information), slope[..., None]
            )[..., 0]
            gain = np.einsum("na,na->n", slope, step)
            if gain.max() < SETTLED:
                break
            longest = np.abs(step / self._longest).max(axis=1)
            share = np.where(gain < SETTLED, 0.0, 1.0 / np.maximum(1.0, longest))
            for _ in range(12):
                tried = latent + share[:, None] * step
                then = self.likelihood.evaluate(tried, lapse)
                higher = _log_posterior(then, tried - centre, precision)
                worse = higher < height - 1e-10 * np.abs(height)
                if not worse.any():
                    break
                share = np.where(worse, share / 3.0, share)
            latent, now, height = tried, then, higher
        self.latent = latent
        return now


def _log_posterior(found: Derivatives, deviation: FloatArray, precision: FloatArray) -> FloatArray:
    """(n,): log-likelihood plus log prior, without the prior's constant."""
    height: FloatArray = found.value - 0.5 * np.einsum("na,ab,nb->n", deviation, precision, deviation)
    return height


def _positive_curvature(observed: FloatArray, expected: FloatArray) -> FloatArray:
    """(n, d, d): the observed curvature, or the expected curvature for persons whose observed curvature is not
    positive definite, as may be far from a mode: the Newton step then still leads uphill."""
    lowest = np.linalg.eigvalsh(observed)[:, 0]
    if lowest.min() > LOWEST_CURVATURE:
        return observed
    return np.where((lowest > LOWEST_CURVATURE)[:, None, None], observed, expected)


def _centre(parameters: FloatArray, k: int) -> FloatArray:
    """(k + 2,): prior means of the thresholds, the log-slope and the criterion (0)."""
    return np.concatenate([parameters[:k], [parameters[k + 2], 0.0]])


def prior_precision(parameters: FloatArray, k: int) -> FloatArray:
    """Inverse covariance of the latent parameters, (k + 2, k + 2): a person has a deviation shared by all frequencies,
    and another at each frequency."""
    shared, own = math.exp(2.0 * parameters[k]), math.exp(2.0 * parameters[k + 1])
    out = np.zeros((k + 2, k + 2))
    mean = np.full((k, k), 1.0 / k)
    out[:k, :k] = (np.eye(k) - mean) / own + mean / (own + k * shared)
    out[k, k], out[k + 1, k + 1] = math.exp(-2.0 * parameters[k + 3]), math.exp(-2.0 * parameters[k + 4])
    return out


def _precision_derivatives(parameters: FloatArray, k: int) -> list[tuple[int, FloatArray, float]]:
    """For each log SD: its index, the derivative of the precision, and that of the precision's log determinant."""
    shared, own = math.exp(2.0 * parameters[k]), math.exp(2.0 * parameters[k + 1])
    together = own + k * shared
    mean = np.full((k, k), 1.0 / k)
    by_shared, by_own, by_slope, by_criterion = (np.zeros((k + 2, k + 2)) for _ in range(4))
    by_shared[:k, :k] = -2.0 * k * shared / together**2 * mean
    by_own[:k, :k] = -2.0 / own * (np.eye(k) - mean) - 2.0 * own / together**2 * mean
    by_slope[k, k] = -2.0 * math.exp(-2.0 * parameters[k + 3])
    by_criterion[k + 1, k + 1] = -2.0 * math.exp(-2.0 * parameters[k + 4])
    return [
        (k, by_shared, -2.0 * k * shared / together),
        (k + 1, by_own, -2.0 * (k - 1) - 2.0 * own / together),
        (k + 3, by_slope, -2.0),
        (k + 4, by_criterion, -2.0),
    ]
