"""Tobit model of reversal means: a sensitivity analysis, in which a run that the cap cut counts as "at least this".

    mean of a run in dB = frequency + person + error, both normal; where the cap cut, P(mean at least what was found)

A cut mean is no clean bound (its valleys lie below the cap), and reversal means near the cap come out low before they
are cut, so this mends a part of the bias only: `measured_coverage` says how much is left.

Source: J. Tobin, Econometrica 26 (1958), 24-36; the person integrated out by Gauss and Hermite's rule: J. C. Pinheiro,
D. M. Bates, J. Comput. Graph. Stat. 4 (1995), 12-35.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize
from scipy.special import log_ndtr, logsumexp
from scipy.stats import t as student

from analysis.psychophysics.group_contrasts import Contrast, holm_correction
from equalizer.signals.signal import FloatArray

NODES, WEIGHTS = np.polynomial.hermite_e.hermegauss(25)
"""Gauss-Hermite rule of the integral over one person's latent mean."""
SD_BOUNDS_DB = (-4.0, 3.5)
"""Logarithms of both standard deviations, in dB."""
STEP = 1e-3
"""Step of the finite differences that give the curvature: dB for means, logarithms for standard deviations."""


@dataclass(frozen=True, slots=True, eq=False)
class TobitFit:
    """Maximum-likelihood estimate of Tobit's model of reversal means."""

    parameters: FloatArray
    """(k + 2,): means in dB, log SD of people, log SD of the error."""
    covariance: FloatArray
    """Inverse curvature of minus the log-likelihood."""
    log_likelihood: float


def tobit_contrasts(
    frequencies_hz: Sequence[float], values_db: FloatArray, cut: NDArray[np.bool_], confidence: float
) -> tuple[Contrast, ...]:
    """Each frequency against the first. values_db, cut: (n, k); NaN for a gap. Wald's intervals with Student's t, n - 1
    degrees of freedom. A frequency without an uncut run is left out: its mean has no upper end. Empty where nothing is
    cut (the model then says what reversal means say), and below three people."""
    known = np.isfinite(values_db)
    bounded: NDArray[np.bool_] = np.asarray((known & ~cut).any(axis=0))
    if not (cut & known).any() or len(values_db) < 3 or not bounded[0]:
        return ()
    frequencies_hz = [frequency_hz for frequency_hz, kept in zip(frequencies_hz, bounded, strict=True) if kept]
    values_db, cut, known = values_db[:, bounded], cut[:, bounded], known[:, bounded]
    fit = fit_tobit(values_db, cut)
    k, df = len(frequencies_hz), len(values_db) - 1
    sizes = fit.parameters[1:k] - fit.parameters[0]
    errors = np.sqrt(np.diag(fit.covariance)[1:k] + fit.covariance[0, 0] - 2.0 * fit.covariance[0, 1:k])
    half = float(student.ppf(0.5 + confidence / 2, df)) * errors
    p_values = [float(p) for p in 2.0 * student.sf(np.abs(sizes / errors), df)]
    both = (known[:, 1:] & known[:, :1]).sum(axis=0)
    return tuple(
        Contrast(
            frequency_hz=frequencies_hz[place + 1],
            against_hz=frequencies_hz[0],
            participants=int(both[place]),
            difference_db=float(sizes[place]),
            lower_db=float(sizes[place] - half[place]),
            upper_db=float(sizes[place] + half[place]),
            p=p_values[place],
            p_holm=p_holm,
            effect_size=None,
            p_equivalence=None,
            p_spread=None,
        )
        for place, p_holm in enumerate(holm_correction(p_values))
    )


def fit_tobit(values_db: FloatArray, cut: NDArray[np.bool_]) -> TobitFit:
    """Maximum likelihood. values_db, cut: (n, k); NaN for a gap; each column needs a value that is not cut."""
    k = values_db.shape[1]
    begin = np.concatenate([np.nanmean(values_db, axis=0), [0.7, 0.7]])

    def cost(parameters: FloatArray) -> float:
        return -_log_likelihood(parameters, values_db, cut)

    bounds = [(None, None)] * k + [SD_BOUNDS_DB] * 2
    found = minimize(cost, begin, method="L-BFGS-B", bounds=bounds, options={"ftol": 1e-12, "gtol": 1e-6})
    steps = STEP * np.eye(k + 2)
    curvature = np.array([[_second(cost, found.x, a, b) for b in steps] for a in steps]) / STEP**2
    # With the spread of people at its lower end the curvature there says nothing, and the means do not depend on it.
    free = np.array([True] * k + [SD_BOUNDS_DB[0] + STEP < value < SD_BOUNDS_DB[1] - STEP for value in found.x[k:]])
    covariance = np.zeros((k + 2, k + 2))
    covariance[np.ix_(free, free)] = np.linalg.inv(curvature[np.ix_(free, free)])
    return TobitFit(found.x, covariance, -float(found.fun))


def _second(cost: Callable[[FloatArray], float], at: FloatArray, a: FloatArray, b: FloatArray) -> float:
    return (cost(at + a + b) - cost(at + a - b) - cost(at - a + b) + cost(at - a - b)) / 4.0


def _log_likelihood(parameters: FloatArray, values_db: FloatArray, cut: NDArray[np.bool_]) -> float:
    k = values_db.shape[1]
    spread, error = math.exp(parameters[k]), math.exp(parameters[k + 1])
    z = (values_db[:, :, None] - parameters[:k, None] - spread * NODES) / error
    exact = -0.5 * z**2 - math.log(error) - 0.5 * math.log(2.0 * math.pi)
    cells = np.where(np.isnan(z), 0.0, np.where(cut[:, :, None], log_ndtr(-z), exact))
    return float(logsumexp(cells.sum(axis=1), b=WEIGHTS / math.sqrt(2.0 * math.pi), axis=1).sum())
