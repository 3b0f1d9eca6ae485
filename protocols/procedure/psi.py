"""Psi method: the next level is that with the least expected posterior entropy of threshold and slope.

A grid holds the posterior probability p(t, s) of every threshold t and slope s after all answers of the run so far,
from a flat prior. For every level x, with the probability P(x; t, s) of a right answer, the entropy after the next
answer is expected to be

    H(x) = - sum over both answers a, and over t, s, of  j_a log(j_a / c_a),
    j_a = P_a(x; t, s) p(t, s),    c_a = sum of j_a over t, s (the probability of the answer).

The next level is a fixed function of the answers before it, so that replaying a log gives the same levels, and the
likelihood of the answers needs no correction. Levels end at the force cap; thresholds of the grid go beyond it, so that
the posterior can say that the threshold lies above the cap.

Source: L. L. Kontsevich, C. W. Tyler, Vision Res. 39 (1999), 2729-2737.
"""

import math
from dataclasses import dataclass
from functools import cache

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]

LEVEL_STEP_DB, LOWEST_LEVEL_DB = 1.0, -34.0
"""Spacing of the levels (dB), and the lowest level relative to the cap (dB): 0.02 of it. Chosen by hand."""
THRESHOLD_MARGIN_DB = 12.0
"""Distance (dB) by which the thresholds of the grid extend above the cap and below the lowest level. Chosen by
hand: thresholds a factor of 4 above the cap remain possible."""
SLOPES = tuple(float(slope) for slope in np.geomspace(0.8, 5.0, 7))
"""Slopes (Weibull exponents) of the psychometric function over newtons, equally probable a priori, spaced geometrically
about 2. Chosen by hand."""
LAPSE_RATE = 0.02
"""Share of trials in which the participant guesses at any level; half of these answers are wrong, so that P(right) ends
at 0.99, a lapse rate of 0.01 in the sense of `analysis.psychophysics.hierarchy.curve`. Chosen by hand: without it a
single lapse at a high level could hardly be outweighed."""
THRESHOLD_SHARE_RIGHT = 0.5 ** (1 / 3)
"""Share of right answers at the threshold, lapses apart, 0.794: that to which the 1 up, 3 down rule of the published
staircase converges."""
ENTROPY_TOLERANCE_NATS = 1e-9
"""Entropies (nats) that differ by at most this from the least are equal, and the lowest level among them is chosen:
rounding must not decide."""

LevelAndAnswer = tuple[float, bool]
"""Level in dB re 1 N, and whether the answer was right."""


@dataclass(frozen=True, slots=True)
class ThresholdEstimate:
    """Estimate of the threshold from its posterior: mean and standard deviation in dB re 1 N."""

    mean_db: float
    sd_db: float
    above_cap: float
    """Probability that the threshold lies above the cap."""


@cache
def list_levels_db(cap_db: float) -> FloatArray:
    """(levels,), ascending: levels that may be presented, in dB re 1 N, LEVEL_STEP_DB apart; the last is the cap,
    cap_db (dB re 1 N)."""
    steps_below_cap = np.arange(round(-LOWEST_LEVEL_DB / LEVEL_STEP_DB), -1, -1, dtype=np.float64)
    return cap_db - LEVEL_STEP_DB * steps_below_cap


@cache
def list_thresholds_db(cap_db: float) -> FloatArray:
    """(thresholds,), ascending: thresholds of the grid in dB re 1 N, LEVEL_STEP_DB apart. cap_db: the cap in dB re 1
    N."""
    levels_db = list_levels_db(cap_db)
    return np.arange(
        float(levels_db[0]) - THRESHOLD_MARGIN_DB, cap_db + THRESHOLD_MARGIN_DB + LEVEL_STEP_DB / 2, LEVEL_STEP_DB
    )


def compute_share_right(level_db: FloatArray, cap_db: float) -> FloatArray:
    """Compute P(right) of every threshold and slope (..., thresholds, slopes) at levels of any shape (...), dB re 1 N.

    A Weibull curve over newtons, F = 1 - exp(-exp(t0 + slope ln(10)/20 (level - threshold))), scaled from the guessing
    rate 1/2 to 1: P = lapse / 2 + (1 - lapse) (1 + F) / 2, with t0 (`log_rate_at_threshold`) so that (1 + F) / 2 is
    `THRESHOLD_SHARE_RIGHT` at the threshold, and lapse = `LAPSE_RATE`.
    """
    log_rate_at_threshold = math.log(-math.log(2.0 - 2.0 * THRESHOLD_SHARE_RIGHT))
    level_above_threshold_db = np.asarray(level_db)[..., None, None] - list_thresholds_db(cap_db)[:, None]
    wrong_share = 0.5 * np.exp(
        -np.exp(log_rate_at_threshold + np.array(SLOPES) * (math.log(10.0) / 20.0) * level_above_threshold_db)
    )
    return LAPSE_RATE / 2 + (1.0 - LAPSE_RATE) * (1.0 - wrong_share)


def compute_posterior(answers: tuple[LevelAndAnswer, ...], cap_db: float) -> FloatArray:
    """Compute the posterior probability (thresholds, slopes) of every threshold and slope after these answers, from a
    flat prior; without answers, the prior. cap_db: the cap in dB re 1 N."""
    log_likelihood = np.zeros((len(list_thresholds_db(cap_db)), len(SLOPES)))
    for level_db, is_right in answers:
        right_probability = compute_share_right(np.array(level_db), cap_db)
        log_likelihood += np.log(right_probability if is_right else 1.0 - right_probability)
    likelihood = np.exp(log_likelihood - log_likelihood.max())
    posterior: FloatArray = likelihood / likelihood.sum()
    return posterior


def choose_level_db(posterior: FloatArray, cap_db: float) -> float:
    """Choose the level (dB re 1 N, at most the cap) after which the least entropy of threshold and slope is expected.
    posterior: (thresholds, slopes), result of `compute_posterior`; cap_db: the cap in dB re 1 N."""
    levels_db, right_share = list_levels_db(cap_db), _tabulate_share_right(cap_db)
    expected_entropy = np.zeros(len(levels_db))
    for answer_probability in (right_share, 1.0 - right_share):
        joint_probability = answer_probability * posterior
        marginal_probability = joint_probability.sum(axis=(1, 2))
        # Entropy of the posterior after this answer, times the probability of the answer. 1e-300 avoids log(0).
        expected_entropy -= (joint_probability * np.log(np.maximum(joint_probability, 1e-300))).sum(
            axis=(1, 2)
        ) - marginal_probability * np.log(marginal_probability)
    return float(levels_db[int(np.flatnonzero(expected_entropy <= expected_entropy.min() + ENTROPY_TOLERANCE_NATS)[0])])


def estimate_threshold(posterior: FloatArray, cap_db: float) -> ThresholdEstimate:
    """Compute mean and standard deviation of the threshold's marginal posterior, and its probability above the cap.
    posterior: (thresholds, slopes), result of `compute_posterior`; cap_db: the cap in dB re 1 N."""
    thresholds_db, threshold_probability = list_thresholds_db(cap_db), posterior.sum(axis=1)
    mean_db = float((threshold_probability * thresholds_db).sum())
    variance_db2 = float((threshold_probability * (thresholds_db - mean_db) ** 2).sum())
    return ThresholdEstimate(
        mean_db, math.sqrt(variance_db2), float(threshold_probability[thresholds_db > cap_db].sum())
    )


@cache
def _tabulate_share_right(cap_db: float) -> FloatArray:
    """(levels, thresholds, slopes): P(right) at all levels of `list_levels_db`. cap_db: the cap in dB re 1 N."""
    return compute_share_right(list_levels_db(cap_db), cap_db)
