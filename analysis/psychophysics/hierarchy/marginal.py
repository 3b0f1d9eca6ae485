"""Marginal likelihood of each person in the hierarchical psychometric model, by Laplace's method, and its gradient.

Population: the threshold of a person at frequency j is mean_j + person + person x frequency (dB), both random effects
normal; the log-slope is normal, the criterion normal around 0; all persons share one lapse rate. Parameters of the
population, in this order (`ParameterLayout`): the k means in dB, log SD of persons, log SD of person x frequency, mean
log-slope, log SD of log-slopes, log SD of criteria, logit of the lapse rate. Latent parameters of a person: k
thresholds, log-slope, criterion.

With the mode z of a person's latent parameters, d = z - prior mean, prior precision P, expected information J:
    log marginal = log-likelihood(z) - d' P d / 2 + (ln det P - ln det(P + J)) / 2.
J replaces the observed curvature, which can vanish at the mode of a run with a lapse, so that the approximation would
diverge.

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
DECREMENT_TOLERANCE = 1e-11
"""Newton decrement (gradient times step) of the log posterior at which a mode is found; the gradient of the marginal
likelihood then has some six correct digits."""
LEAST_CURVATURE = 1e-5
"""Least eigenvalue of the observed curvature that is used for a Newton step. A prior SD of 30 dB, with no answers, has
a curvature of 1e-3 per dB², well above it."""
LONGEST_STEP_DB, LONGEST_STEP_SLOPE, LONGEST_STEP_CRITERION = 6.0, 0.7, 1.0
"""Largest Newton step in a threshold (dB), a log-slope and a criterion (units of d'): over larger steps the log
posterior is not quadratic."""


@dataclass(frozen=True, slots=True)
class ParameterLayout:
    """Indices of the population's parameters in their vector, (k + 6,), for k frequencies."""

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


class MarginalLikelihood:
    """Marginal likelihood of n persons by Laplace's method. The modes, `latent` (n, k + 2), are kept as the starting
    values of the next search."""

    def __init__(self, likelihood: TrialLikelihood, latent: FloatArray) -> None:
        self.likelihood, self.latent = likelihood, latent
        self.layout = ParameterLayout(likelihood.frequencies)
        self._max_steps = np.array(
            [LONGEST_STEP_DB] * likelihood.frequencies + [LONGEST_STEP_SLOPE, LONGEST_STEP_CRITERION]
        )

    def evaluate(self, parameters: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Evaluate the log marginal likelihood of each person (n,), and its gradient (n, k + 6). parameters: (k + 6,),
        see `ParameterLayout`."""
        layout, k = self.layout, self.layout.k
        precision, prior_mean = compute_prior_precision(parameters, k), _compute_prior_mean(parameters, k)
        lapse = float(expit(parameters[layout.lapse]))
        derivatives = self._maximise_posterior(precision, prior_mean, lapse)
        deviation = self.latent - prior_mean
        inverse = np.linalg.inv(precision + derivatives.information).astype(np.float64)
        trace_by_latent, trace_by_lapse = self.likelihood.trace_derivatives(self.latent, lapse, inverse)
        # Implicit differentiation of the mode needs the observed curvature, although det(P + J) uses the expected one.
        adjoint = np.linalg.solve(precision - derivatives.second, trace_by_latent[..., None])[..., 0]
        weighted_deviation = deviation @ precision
        value = (
            derivatives.value
            - 0.5 * np.einsum("na,na->n", deviation, weighted_deviation)
            + 0.5 * np.linalg.slogdet(precision)[1]
            + 0.5 * np.linalg.slogdet(inverse)[1]
        )
        gradient = np.empty((len(value), layout.size))
        gradient_by_centre = weighted_deviation - 0.5 * adjoint @ precision
        gradient[:, :k], gradient[:, layout.slope] = gradient_by_centre[:, :k], gradient_by_centre[:, k]
        for index, precision_change, log_det in _differentiate_precision(parameters, k):
            changed_deviation = deviation @ precision_change
            gradient[:, index] = (
                -0.5 * np.einsum("na,na->n", deviation, changed_deviation)
                + 0.5 * log_det
                - 0.5 * np.einsum("nab,ab->n", inverse, precision_change)
                + 0.5 * np.einsum("na,na->n", adjoint, changed_deviation)
            )
        gradient[:, layout.lapse] = (lapse * (1.0 - lapse)) * (
            derivatives.lapse_derivative
            - 0.5 * trace_by_lapse
            - 0.5 * np.einsum("na,na->n", adjoint, derivatives.gradient_lapse_derivative)
        )
        return value, gradient

    def find_modes(self, parameters: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Find the mode of each person's latent parameters (n, k + 2). Returns it, and the answers' expected
        information there (n, k + 2, k + 2)."""
        k, lapse = self.layout.k, float(expit(parameters[self.layout.lapse]))
        derivatives = self._maximise_posterior(
            compute_prior_precision(parameters, k), _compute_prior_mean(parameters, k), lapse
        )
        return self.latent, derivatives.information

    def _maximise_posterior(self, precision: FloatArray, prior_mean: FloatArray, lapse: float) -> Derivatives:
        """Find the modes by Newton's method for all persons at once, from `latent`, which they replace. A step that
        lowers a person's log posterior (by more than rounding, 1e-10 of it) is divided by 3, at most 11 times. Returns
        the derivatives at the modes. precision: (k + 2, k + 2); prior_mean: (k + 2,); lapse: lapse rate."""
        latent = self.latent.copy()
        current = self.likelihood.evaluate(latent, lapse)
        log_posterior = _compute_log_posterior(current, latent - prior_mean, precision)
        for _ in range(NEWTON_STEPS):
            gradient = current.first - (latent - prior_mean) @ precision
            step = np.linalg.solve(
                _choose_curvature(precision - current.second, precision + current.information), gradient[..., None]
            )[..., 0]
            newton_decrement = np.einsum("na,na->n", gradient, step)
            if newton_decrement.max() < DECREMENT_TOLERANCE:
                break
            step_ratio = np.abs(step / self._max_steps).max(axis=1)
            step_fraction = np.where(newton_decrement < DECREMENT_TOLERANCE, 0.0, 1.0 / np.maximum(1.0, step_ratio))
            for _ in range(12):
                trial_latent = latent + step_fraction[:, None] * step
                trial = self.likelihood.evaluate(trial_latent, lapse)
                trial_log_posterior = _compute_log_posterior(trial, trial_latent - prior_mean, precision)
                is_lower = trial_log_posterior < log_posterior - 1e-10 * np.abs(log_posterior)
                if not is_lower.any():
                    break
                step_fraction = np.where(is_lower, step_fraction / 3.0, step_fraction)
            latent, current, log_posterior = trial_latent, trial, trial_log_posterior
        self.latent = latent
        return current


def _compute_log_posterior(derivatives: Derivatives, deviation: FloatArray, precision: FloatArray) -> FloatArray:
    """Compute log-likelihood plus log prior (n,), without the prior's constant. deviation: (n, k + 2), from the prior
    mean."""
    log_posterior: FloatArray = derivatives.value - 0.5 * np.einsum("na,ab,nb->n", deviation, precision, deviation)
    return log_posterior


def _choose_curvature(observed: FloatArray, expected: FloatArray) -> FloatArray:
    """Choose the curvature (n, k + 2, k + 2): the observed one, or the expected one for persons whose observed
    curvature is not positive definite (least eigenvalue up to `LEAST_CURVATURE`), so that every Newton step is an
    ascent direction."""
    lowest = np.linalg.eigvalsh(observed)[:, 0]
    if lowest.min() > LEAST_CURVATURE:
        return observed
    return np.where((lowest > LEAST_CURVATURE)[:, None, None], observed, expected)


def _compute_prior_mean(parameters: FloatArray, k: int) -> FloatArray:
    """Compute the prior means (k + 2,) of the thresholds (dB), the log-slope and the criterion (0)."""
    return np.concatenate([parameters[:k], [parameters[k + 2], 0.0]])


def compute_prior_precision(parameters: FloatArray, k: int) -> FloatArray:
    """Compute the prior precision (k + 2, k + 2), the inverse covariance of the latent parameters. Covariance of the
    thresholds: variance of persons for all pairs, plus variance of person x frequency on the diagonal."""
    shared_variance, interaction_variance = math.exp(2.0 * parameters[k]), math.exp(2.0 * parameters[k + 1])
    precision = np.zeros((k + 2, k + 2))
    averaging = np.full((k, k), 1.0 / k)
    precision[:k, :k] = (np.eye(k) - averaging) / interaction_variance + averaging / (
        interaction_variance + k * shared_variance
    )
    precision[k, k], precision[k + 1, k + 1] = math.exp(-2.0 * parameters[k + 3]), math.exp(-2.0 * parameters[k + 4])
    return precision


def _differentiate_precision(parameters: FloatArray, k: int) -> list[tuple[int, FloatArray, float]]:
    """Differentiate the precision by each log SD. Returns for each its index, the derivative of the precision (k + 2,
    k + 2), and that of the precision's log determinant."""
    shared_variance, interaction_variance = math.exp(2.0 * parameters[k]), math.exp(2.0 * parameters[k + 1])
    total_variance = interaction_variance + k * shared_variance
    averaging = np.full((k, k), 1.0 / k)
    by_shared, by_interaction, by_slope, by_criterion = (np.zeros((k + 2, k + 2)) for _ in range(4))
    by_shared[:k, :k] = -2.0 * k * shared_variance / total_variance**2 * averaging
    by_interaction[:k, :k] = (
        -2.0 / interaction_variance * (np.eye(k) - averaging)
        - 2.0 * interaction_variance / total_variance**2 * averaging
    )
    by_slope[k, k] = -2.0 * math.exp(-2.0 * parameters[k + 3])
    by_criterion[k + 1, k + 1] = -2.0 * math.exp(-2.0 * parameters[k + 4])
    return [
        (k, by_shared, -2.0 * k * shared_variance / total_variance),
        (k + 1, by_interaction, -2.0 * (k - 1) - 2.0 * interaction_variance / total_variance),
        (k + 3, by_slope, -2.0),
        (k + 4, by_criterion, -2.0),
    ]
