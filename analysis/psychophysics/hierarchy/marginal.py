"""The marginal likelihood of each person by Laplace's method, with its exact gradient.

Population: theta = mean_j + person + person x frequency, both normal; log-slope normal; criterion normal around 0; one
lapse rate. Its parameters, in this order (`Layout`): the k means in dB, log SD of persons, log SD of person x
frequency, mean log-slope, log SD of it, log SD of criteria, logit of the lapse rate.

Why adaptive levels change nothing: each level follows from the answers before it by a fixed rule. The probability of a
whole run is then the product of the probabilities of its answers at the levels played, times factors without any
unknown (ignorable in the sense of D. B. Rubin, Biometrika 63 (1976), 581-592). The same holds at the cap: an answer
there is an answer at 3 N, neither censored nor less true.

The volume around each mode is taken from the expected information, not from the observed curvature: a run with a lapse
at the wrong place can have a mode as flat as a table, where the observed curvature makes the approximation infinite.

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
"""Most Newton steps to the mode of a person's parameters."""
SETTLED = 1e-11
"""Newton decrement of the log-likelihood at which a mode is found: then the gradient is right to some six digits."""
LOWEST_CURVATURE = 1e-5
"""Least curvature of a Newton step, per dB squared: below it the step length is undetermined. Where people have nothing
in common, that of a threshold without answers is 1e-3."""
LONGEST_STEP_DB, LONGEST_STEP_SLOPE, LONGEST_STEP_D = 6.0, 0.7, 1.0
"""Largest Newton step in a threshold, a log-slope and a criterion: the model is not quadratic over larger ones."""


@dataclass(frozen=True, slots=True)
class Layout:
    """Indices of the population's parameters, for k frequencies."""

    k: int

    @property
    def size(self) -> int:
        """Number of parameters."""
        return self.k + 6

    @property
    def log_sds(self) -> list[int]:
        """Log standard deviations: of persons, of person x frequency, of log-slopes, of criteria."""
        return [self.k, self.k + 1, self.k + 3, self.k + 4]

    @property
    def slope(self) -> int:
        """The mean log-slope."""
        return self.k + 2

    @property
    def lapse(self) -> int:
        """The logit of the lapse rate."""
        return self.k + 5


class Marginal:
    """Remembers the last modes, so that the next search begins there."""

    def __init__(self, likelihood: TrialLikelihood, latent: FloatArray) -> None:
        self.likelihood, self.latent = likelihood, latent
        self.layout = Layout(likelihood.frequencies)
        self._longest = np.array([LONGEST_STEP_DB] * likelihood.frequencies + [LONGEST_STEP_SLOPE, LONGEST_STEP_D])

    def evaluate(self, parameters: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Log marginal likelihood of each person (n,), and its gradient (n, size)."""
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
        """Mode of each person (n, k + 2), and the information of the answers there (n, k + 2, k + 2)."""
        k, lapse = self.layout.k, float(expit(parameters[self.layout.lapse]))
        found = self._find_modes(prior_precision(parameters, k), _centre(parameters, k), lapse)
        return self.latent, found.information

    def _find_modes(self, precision: FloatArray, centre: FloatArray, lapse: float) -> Derivatives:
        """Newton's method for all persons at once; a step that does not gain is halved for that person alone."""
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
    height: FloatArray = found.value - 0.5 * np.einsum("na,ab,nb->n", deviation, precision, deviation)
    return height


def _positive_curvature(observed: FloatArray, expected: FloatArray) -> FloatArray:
    """Far from a mode the observed curvature may be indefinite: the expected one then leads uphill."""
    lowest = np.linalg.eigvalsh(observed)[:, 0]
    if lowest.min() > LOWEST_CURVATURE:
        return observed
    return np.where((lowest > LOWEST_CURVATURE)[:, None, None], observed, expected)


def _centre(parameters: FloatArray, k: int) -> FloatArray:
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
    """Per log SD: its place, the change of the precision, and of the precision's log determinant."""
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
