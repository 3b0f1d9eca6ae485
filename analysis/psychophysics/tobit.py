"""Tobit model of reversal means: a sensitivity analysis in which runs that reached the force cap are right-censored.

    y_ij = mu_j + b_i + e_ij,    b_i ~ N(0, sd_people²),  e_ij ~ N(0, sd_error²)    person i, frequency j; y in dB

y is the mean level at the reversals of a staircase run. A run is censored where at least one of these reversals is a
peak at the largest permitted force, the cap (`thresholds.is_censored`). Under Psi, y is the posterior mean, and
`thresholds.CUT_PROBABILITY` decides. An uncensored run contributes the density of y to the likelihood, a censored run
P(Y >= y). The random effect b_i is integrated out by Gauss-Hermite quadrature.

Limits: the mean of a censored run is not an exact lower bound, because its valleys lie below the cap, and means near
the cap are biased low even in uncensored runs. The model therefore removes only a part of the bias; `measured_coverage`
holds the coverage that its intervals reach in simulations.

Sources: J. Tobin, Econometrica 26 (1958), 24-36; quadrature: J. C. Pinheiro, D. M. Bates, J. Comput. Graph. Stat. 4
(1995), 12-35. Called by `analysis.psychophysics.study_analysis`.
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
"""Gauss-Hermite rule of the integral over a person's random effect: weight function exp(-x²/2), x = b / sd_people. The
number of nodes is chosen."""
LOG_SD_BOUNDS = (-4.0, 3.5)
"""Bounds of the natural logarithm of both standard deviations: 0.018 dB to 33 dB."""
DIFFERENCE_STEP = 1e-3
"""Step of the finite differences of the log-likelihood's second derivatives: in dB for means, in natural logarithms for
standard deviations."""


@dataclass(frozen=True, slots=True, eq=False)
class TobitFit:
    """Maximum-likelihood estimate of the Tobit model of reversal means."""

    parameters: FloatArray
    """(k + 2,): means mu in dB, then the natural logarithms of sd_people and sd_error."""
    covariance: FloatArray
    """(k + 2, k + 2): inverse Hessian of minus the log-likelihood; zero for a standard deviation at its bound."""
    log_likelihood: float


def compute_tobit_contrasts(
    frequencies_hz: Sequence[float], values_db: FloatArray, is_censored: NDArray[np.bool_], confidence: float
) -> tuple[Contrast, ...]:
    """Compute the contrasts mu_j - mu_1 of each frequency with the first, with Wald intervals and p values of Student's
    t with n - 1 degrees of freedom. values_db: (n, k), dB, NaN for a gap. is_censored: (n, k). confidence: level
    of the intervals, 0 to 1.

    A frequency without an uncensored run is left out, because its likelihood has no maximum. Empty where no run is
    censored (the analysis of the plain means then suffices), the first frequency or every other one is left out, or
    there are fewer than three people (chosen). `Contrast.p_holm` is corrected over the contrasts that are returned
    alone. Raises LinAlgError as `fit_tobit` does.
    """
    is_measured = np.isfinite(values_db)
    has_uncensored: NDArray[np.bool_] = np.asarray((is_measured & ~is_censored).any(axis=0))
    if not (is_censored & is_measured).any() or len(values_db) < 3 or not has_uncensored[0]:
        return ()
    frequencies_hz = [
        frequency_hz for frequency_hz, is_kept in zip(frequencies_hz, has_uncensored, strict=True) if is_kept
    ]
    values_db, is_censored, is_measured = (
        values_db[:, has_uncensored],
        is_censored[:, has_uncensored],
        is_measured[:, has_uncensored],
    )
    fit = fit_tobit(values_db, is_censored)
    frequency_count, df = len(frequencies_hz), len(values_db) - 1
    differences_db = fit.parameters[1:frequency_count] - fit.parameters[0]
    standard_errors_db = np.sqrt(
        np.diag(fit.covariance)[1:frequency_count] + fit.covariance[0, 0] - 2.0 * fit.covariance[0, 1:frequency_count]
    )
    half_widths_db = float(student.ppf(0.5 + confidence / 2, df)) * standard_errors_db
    p_values = [float(p) for p in 2.0 * student.sf(np.abs(differences_db / standard_errors_db), df)]
    pair_counts = (is_measured[:, 1:] & is_measured[:, :1]).sum(axis=0)
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
        for index, p_holm in enumerate(apply_holm_correction(p_values))
    )


def fit_tobit(values_db: FloatArray, is_censored: NDArray[np.bool_]) -> TobitFit:
    """Fit the Tobit model by maximum likelihood (L-BFGS-B). values_db: (n, k), dB, NaN for a gap; is_censored: (n,
    k). Each column needs an uncensored value. An optimiser that does not converge is not reported. Raises LinAlgError
    where the Hessian is singular."""
    frequency_count = values_db.shape[1]
    # Start: the means of the columns, and standard deviations of exp(0.7) = 2 dB (chosen).
    start_parameters = np.concatenate([np.nanmean(values_db, axis=0), [0.7, 0.7]])

    def compute_cost(parameters: FloatArray) -> float:
        return -_compute_log_likelihood(parameters, values_db, is_censored)

    bounds = [(None, None)] * frequency_count + [LOG_SD_BOUNDS] * 2
    solution = minimize(
        compute_cost, start_parameters, method="L-BFGS-B", bounds=bounds, options={"ftol": 1e-12, "gtol": 1e-6}
    )
    steps = DIFFERENCE_STEP * np.eye(frequency_count + 2)
    hessian = (
        np.array(
            [
                [_compute_second_difference(compute_cost, solution.x, row_step, column_step) for column_step in steps]
                for row_step in steps
            ]
        )
        / DIFFERENCE_STEP**2
    )
    # At a bound, the Hessian by a standard deviation is meaningless: that parameter is held fixed in the covariance.
    is_free = np.array(
        [True] * frequency_count
        + [
            LOG_SD_BOUNDS[0] + DIFFERENCE_STEP < value < LOG_SD_BOUNDS[1] - DIFFERENCE_STEP
            for value in solution.x[frequency_count:]
        ]
    )
    covariance = np.zeros((frequency_count + 2, frequency_count + 2))
    covariance[np.ix_(is_free, is_free)] = np.linalg.inv(hessian[np.ix_(is_free, is_free)])
    return TobitFit(solution.x, covariance, -float(solution.fun))


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
    standardised_residual = (
        values_db[:, :, None] - parameters[:frequency_count, None] - sd_people * QUADRATURE_NODES
    ) / sd_error
    log_density = -0.5 * standardised_residual**2 - math.log(sd_error) - 0.5 * math.log(2.0 * math.pi)
    log_likelihoods = np.where(
        np.isnan(standardised_residual),
        0.0,
        np.where(is_censored[:, :, None], log_ndtr(-standardised_residual), log_density),
    )
    return float(logsumexp(log_likelihoods.sum(axis=1), b=QUADRATURE_WEIGHTS / math.sqrt(2.0 * math.pi), axis=1).sum())
