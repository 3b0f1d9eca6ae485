"""Tobit model of reversal means: a sensitivity analysis in which runs that reached the force cap are right-censored.

    y_ij = mu_j + b_i + e_ij,    b_i ~ N(0, sd_people²),  e_ij ~ N(0, sd_error²)    person i, frequency j; y in dB

y is the mean level at the reversals of a staircase run. A run is censored where at least one of these reversals is a
peak at the largest permitted force, the cap (`thresholds.is_censored`). Under Psi, y is the posterior mean, and
`thresholds.CUT_PROBABILITY` decides. An uncensored run contributes the density of y to the likelihood, a censored run
P(Y >= y). The random effect b_i is integrated out: exactly over its normal distribution given the person's uncensored
values, and over the censored ones by Gauss-Hermite quadrature under that distribution. Nodes spread over N(0,
sd_people²) would lie farther apart than the values leave b_i uncertain, where people differ more than the errors.

Limits: the mean of a censored run is not an exact lower bound, because its valleys lie below the cap, and means near
the cap are biased low even in uncensored runs. The model therefore removes only a part of the bias; `measured_coverage`
holds the coverage that its intervals reach in simulations.

Sources: J. Tobin, Econometrica 26 (1958), 24-36; quadrature: J. C. Pinheiro, D. M. Bates, J. Comput. Graph. Stat. 4
(1995), 12-35.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize
from scipy.special import log_ndtr, logsumexp
from scipy.stats import t as student

from analysis.psychophysics.group_contrasts import Contrast, apply_holm_correction
from equalizer.signals.signal import FloatArray

QUADRATURE_NODES, QUADRATURE_WEIGHTS = np.polynomial.hermite_e.hermegauss(25)
"""Gauss-Hermite rule of the integral over a person's random effect: weight function exp(-x²/2), x = (b - mean) / sd
given the uncensored values. The number of nodes is chosen."""
LOG_SD_BOUNDS = (-4.0, 3.5)
"""Bounds of the natural logarithm of both standard deviations: 0.018 dB to 33 dB."""
DIFFERENCE_STEP = 1e-3
"""Step of the finite differences of the log-likelihood's second derivatives: in dB for means, in natural logarithms for
standard deviations."""
SINGULAR_CURVATURE = 1e-6
"""Curvature of the log-likelihood along a direction, relative to its largest, up to which the direction counts as
undetermined: both standard deviations where no person has two values. It is held fixed in the covariance. Chosen."""
CONVERGED_DECREMENT = 1e-4
"""Largest squared Newton step to the maximum, in standard errors, of a fit that counts as converged: a remaining error
of at most 1 % of a standard error. Chosen. The optimiser's own flag is no criterion: it also reports a failure where
the maximum is reached within the rounding of its finite differences."""


@dataclass(frozen=True, slots=True, eq=False)
class TobitFit:
    """Maximum-likelihood estimate of the Tobit model of reversal means."""

    parameters: FloatArray
    """(k + 2,): means mu in dB, then the natural logarithms of sd_people and sd_error."""
    covariance: FloatArray
    """(k + 2, k + 2): inverse Hessian of minus the log-likelihood; zero for the standard deviation of people at its
    bound, and along a direction that the data do not determine."""
    log_likelihood: float


def compute_tobit_contrasts(
    frequencies_hz: Sequence[float], values_db: FloatArray, is_censored: NDArray[np.bool_], confidence: float
) -> tuple[Contrast, ...]:
    """Compute the contrasts mu_j - mu_1 of each frequency with the first, with Wald intervals and p values of Student's
    t with n - 1 degrees of freedom. values_db: (n, k), dB, NaN for a gap. is_censored: (n, k). confidence: level
    of the intervals, 0 to 1.

    A frequency without an uncensored run is left out, because its likelihood has no maximum, but counts in Holm's
    family; a person without a value at the others is left out, too. Empty where no run is censored (the analysis of
    the plain means then suffices), the first frequency or every other one is left out, fewer than three people remain
    (chosen), or the fit fails (`fit_tobit`).
    """
    planned_contrasts, is_measured = len(frequencies_hz) - 1, np.isfinite(values_db)
    is_kept: NDArray[np.bool_] = np.asarray((is_measured & ~is_censored).any(axis=0))
    has_values: NDArray[np.bool_] = np.asarray(is_measured[:, is_kept].any(axis=1))
    if not (is_censored & is_measured).any() or has_values.sum() < 3 or not is_kept[0]:
        return ()
    frequencies_hz = [hz for hz, is_fitted in zip(frequencies_hz, is_kept, strict=True) if is_fitted]
    cells = np.ix_(has_values, is_kept)
    values_db, is_censored, is_measured = values_db[cells], is_censored[cells], is_measured[cells]
    try:
        fit = fit_tobit(values_db, is_censored)
    except np.linalg.LinAlgError:
        return ()
    pair_counts = (is_measured[:, 1:] & is_measured[:, :1]).sum(axis=0)
    return _make_contrasts(fit, frequencies_hz, pair_counts, (len(values_db) - 1, planned_contrasts), confidence)


def _make_contrasts(
    fit: TobitFit,
    frequencies_hz: Sequence[float],
    pair_counts: NDArray[np.intp],
    df_and_family: tuple[int, int],
    confidence: float,
) -> tuple[Contrast, ...]:
    """Make the contrasts of a fit of k frequencies. pair_counts: (k - 1,), people with values at both frequencies.
    df_and_family: degrees of freedom, and the number of planned contrasts."""
    frequency_count, (df, planned_contrasts) = len(frequencies_hz), df_and_family
    differences_db = fit.parameters[1:frequency_count] - fit.parameters[0]
    standard_errors_db = np.sqrt(
        np.diag(fit.covariance)[1:frequency_count] + fit.covariance[0, 0] - 2.0 * fit.covariance[0, 1:frequency_count]
    )
    half_widths_db = float(student.ppf(0.5 + confidence / 2, df)) * standard_errors_db
    p_values = [float(p) for p in 2.0 * student.sf(np.abs(differences_db / standard_errors_db), df)]
    return tuple(
        Contrast(
            frequency_hz=frequencies_hz[index + 1],
            against_hz=frequencies_hz[0],
            participants=int(pair_counts[index]),
            difference_db=float(differences_db[index]),
            lower_db=float(differences_db[index] - half_widths_db[index]),
            upper_db=float(differences_db[index] + half_widths_db[index]),
            p=p_values[index],
            p_holm=p_holm,
            effect_size=None,
            p_equivalence=None,
            p_spread=None,
        )
        for index, p_holm in enumerate(apply_holm_correction(p_values, planned_contrasts))
    )


def fit_tobit(values_db: FloatArray, is_censored: NDArray[np.bool_]) -> TobitFit:
    """Fit the Tobit model by maximum likelihood (L-BFGS-B). values_db: (n, k), dB, NaN for a gap; is_censored: (n,
    k). Each column needs an uncensored value. Raises LinAlgError where the data do not determine the errors' standard
    deviation, or the optimiser did not reach the maximum (`CONVERGED_DECREMENT`)."""
    frequency_count = values_db.shape[1]
    # Start: the means of the columns, and standard deviations of exp(0.7) = 2 dB (chosen).
    start_parameters = np.concatenate([np.nanmean(values_db, axis=0), [0.7, 0.7]])

    def compute_cost(parameters: FloatArray) -> float:
        return -_compute_log_likelihood(parameters, values_db, is_censored)

    bounds = [(None, None)] * frequency_count + [LOG_SD_BOUNDS] * 2
    solution = minimize(
        compute_cost, start_parameters, method="L-BFGS-B", bounds=bounds, options={"ftol": 1e-12, "gtol": 1e-6}
    )
    return TobitFit(solution.x, _compute_covariance(compute_cost, solution.x), -float(solution.fun))


def _compute_covariance(compute_cost: Callable[[FloatArray], float], parameters: FloatArray) -> FloatArray:
    """Compute the inverse Hessian of the cost at the fitted parameters (k + 2,). Raises LinAlgError as `fit_tobit`."""
    steps = DIFFERENCE_STEP * np.eye(len(parameters))
    hessian = (
        np.array(
            [
                [_compute_second_difference(compute_cost, parameters, row_step, column_step) for column_step in steps]
                for row_step in steps
            ]
        )
        / DIFFERENCE_STEP**2
    )
    gradient = np.array([compute_cost(parameters + step) - compute_cost(parameters - step) for step in steps]) / (
        2.0 * DIFFERENCE_STEP
    )
    lower, upper = (LOG_SD_BOUNDS[0] + DIFFERENCE_STEP, LOG_SD_BOUNDS[1] - DIFFERENCE_STEP)
    is_free = np.array([True] * (len(parameters) - 2) + [lower < log_sd < upper for log_sd in parameters[-2:]])
    free = np.ix_(is_free, is_free)
    eigenvalues = np.linalg.eigvalsh(hessian[free])
    if not is_free[-1] or eigenvalues[0] < -SINGULAR_CURVATURE * eigenvalues[-1]:
        raise np.linalg.LinAlgError("the standard errors would follow from the bounds, not from the data")
    # At a bound, the Hessian by the standard deviation of people is meaningless: it is held fixed in the covariance.
    covariance = np.zeros_like(hessian)
    covariance[free] = np.linalg.pinv(hessian[free], rcond=SINGULAR_CURVATURE, hermitian=True)
    if not gradient @ covariance @ gradient <= CONVERGED_DECREMENT:
        raise np.linalg.LinAlgError("the optimiser did not reach the maximum of the likelihood")
    return covariance


def _compute_second_difference(
    compute_cost: Callable[[FloatArray], float], centre: FloatArray, first_step: FloatArray, second_step: FloatArray
) -> float:
    """Compute the central second difference of the cost along `first_step` and `second_step`, not divided by their
    lengths."""
    return (
        compute_cost(centre + first_step + second_step)
        - compute_cost(centre + first_step - second_step)
        - compute_cost(centre - first_step + second_step)
        + compute_cost(centre - first_step - second_step)
    ) / 4.0


def _compute_log_likelihood(parameters: FloatArray, values_db: FloatArray, is_censored: NDArray[np.bool_]) -> float:
    """Compute the log-likelihood of the Tobit model at `parameters` (k + 2,), see `TobitFit`; gaps contribute
    nothing."""
    frequency_count = values_db.shape[1]
    sd_people, sd_error = math.exp(parameters[frequency_count]), math.exp(parameters[frequency_count + 1])
    residuals_db, is_measured = values_db - parameters[:frequency_count], np.isfinite(values_db)
    known = np.where(is_measured & ~is_censored, residuals_db / sd_error, 0.0)
    known_count = (is_measured & ~is_censored).sum(axis=1)
    # Normal distribution of the effect given the uncensored values: mean and standard deviation in dB.
    effect_sd = 1.0 / np.sqrt(1.0 / sd_people**2 + known_count / sd_error**2)
    effect_mean = effect_sd**2 * known.sum(axis=1) / sd_error
    log_densities = np.log(effect_sd / sd_people) - known_count * (math.log(sd_error) + 0.5 * math.log(2.0 * math.pi))
    log_densities -= 0.5 * ((known**2).sum(axis=1) - (effect_mean / effect_sd) ** 2)
    effects_db = effect_mean[:, None, None] + effect_sd[:, None, None] * QUADRATURE_NODES
    log_tails = np.where(
        (is_measured & is_censored)[:, :, None], log_ndtr((effects_db - residuals_db[:, :, None]) / sd_error), 0.0
    ).sum(axis=1)
    log_tails = logsumexp(log_tails, b=QUADRATURE_WEIGHTS / math.sqrt(2.0 * math.pi), axis=1)
    return float(np.sum(log_densities + log_tails))
