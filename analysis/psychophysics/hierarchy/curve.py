"""Psychometric functions of one-interval identification: mean evidence q(t) over the level, with two derivatives.

An unbiased attentive participant answers right with the probability 1/2 + F(t)/2, so the evidence for the direction
shown has the mean q(t) with Phi(q) = 1/2 + F(t)/2 (half of d'). Three shapes of F, each over levels in dB:

    Weibull (over newtons)   1 - F = exp(-exp(t))
    logistic                 1 - F = 1 / (1 + exp(t))
    Gauss                    1 - F = Phi(-t)

t = t0 + slope ln(10)/20 (level - threshold), where t0 makes the share of right answers at the threshold, 1/2 + F(t0)/2,
that to which the staircase converges: 79.37 %.

Source: F. A. Wichmann, N. J. Hill, Percept. Psychophys. 63 (2001), 1293-1313; N. A. Macmillan, C. D. Creelman,
Detection Theory: A User's Guide, 2nd ed. (2005), chapters 1 and 2.
"""

import math
from enum import StrEnum
from statistics import NormalDist

import numpy as np
from scipy.special import erfcx, log_ndtr, ndtr, ndtri_exp

from equalizer.signals.signal import FloatArray

TARGET_PROPORTION = 0.5 ** (1 / 3)
"""Share p of right answers at a threshold: where three right answers in a row, which lower the level, are as likely as
not, p^3 = 1/2 (H. Levitt, J. Acoust. Soc. Am. 49 (1971), 467-477)."""
NEPER_PER_DB = math.log(10.0) / 20.0
"""Natural logarithm of an amplitude ratio of 1 dB."""
LARGEST_T = 30.0
"""Largest t that is evaluated: 1 - F is then at most 1e-13, so that practically no answer of an attentive participant
is wrong."""


class Family(StrEnum):
    """Shape F of the psychometric function."""

    WEIBULL = "weibull"
    LOGISTIC = "logistic"
    GAUSS = "gauss"


_F_AT_THRESHOLD = 2.0 * TARGET_PROPORTION - 1.0
"""F at the threshold, so that 1/2 + F/2 is `TARGET_PROPORTION`."""
T_AT_THRESHOLD = {
    Family.WEIBULL: math.log(-math.log(1.0 - _F_AT_THRESHOLD)),
    Family.LOGISTIC: math.log(_F_AT_THRESHOLD / (1.0 - _F_AT_THRESHOLD)),
    Family.GAUSS: NormalDist().inv_cdf(_F_AT_THRESHOLD),
}
"""t0 of each family."""
STARTING_SLOPE = {Family.WEIBULL: 2.0, Family.LOGISTIC: 3.0, Family.GAUSS: 1.9}
"""Slope at which a search begins, by family: chosen as a Weibull slope of 2 over newtons, and slopes about as steep at
the threshold."""


def differentiate_evidence(t: FloatArray, family: Family) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Compute q(t) and its first two derivatives by t, each in the shape of t. t above `LARGEST_T` is replaced by
    it."""
    log_survival, log_survival_derivative, log_survival_curvature = _compute_log_survival(
        np.minimum(t, LARGEST_T), family
    )
    # Phi(-q) = (1 - F) / 2. With w the logarithm of that: dq/dw = -M, M the Mills ratio Phi(-q) / phi(q).
    q = -ndtri_exp(log_survival - math.log(2.0))
    mills_ratio = math.sqrt(math.pi / 2) * erfcx(q / math.sqrt(2.0))
    return (
        q,
        -mills_ratio * log_survival_derivative,
        mills_ratio * (q * mills_ratio - 1.0) * log_survival_derivative**2 - mills_ratio * log_survival_curvature,
    )


def compute_mean_evidence(t: FloatArray, family: Family) -> FloatArray:
    """Compute q(t) in the shape of t, faster than `differentiate_evidence`. t above `LARGEST_T` is replaced by it."""
    t = np.minimum(t, LARGEST_T)
    match family:
        case Family.WEIBULL:
            log_survival = -np.exp(t)
        case Family.LOGISTIC:
            log_survival = -np.logaddexp(0.0, t)
        case Family.GAUSS:
            log_survival = log_ndtr(-t)
    q: FloatArray = -ndtri_exp(log_survival - math.log(2.0))
    return q


def compute_proportion_correct(evidence: FloatArray, lapse: float) -> FloatArray:
    """Compute P(right) in the shape of evidence, the mean q(t) - side * criterion in units of d'; lapse: lapse rate,
    the probability of a wrong answer at any level however high: half of all inattentive answers, as the other half are
    right by chance."""
    proportion_correct: FloatArray = lapse + (1.0 - 2.0 * lapse) * ndtr(evidence)
    return proportion_correct


def _compute_log_survival(t: FloatArray, family: Family) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Compute log(1 - F) and its first two derivatives by t, each in the shape of t."""
    match family:
        case Family.WEIBULL:
            log_survival = -np.exp(t)
            return log_survival, log_survival, log_survival
        case Family.LOGISTIC:
            distribution = 1.0 / (1.0 + np.exp(-t))
            return -np.logaddexp(0.0, t), -distribution, -distribution * (1.0 - distribution)
        case Family.GAUSS:
            hazard = 1.0 / (math.sqrt(math.pi / 2) * erfcx(t / math.sqrt(2.0)))
            return log_ndtr(-t), -hazard, -hazard * (hazard - t)
