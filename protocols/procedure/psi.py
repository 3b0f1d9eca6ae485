"""Psi method: the next level is that with the least expected posterior entropy of threshold and slope.

A grid holds the posterior probability p(t, s) of every threshold t and slope s after all answers of the run so far,
from a flat prior. For every level x, with P(x; t, s) of a right answer, the entropy after the next answer is expected
to be

    H(x) = - sum over both answers a, and over t, s, of  j_a log(j_a / c_a),
    j_a = P_a(x; t, s) p(t, s),    c_a = sum of j_a over t, s (the probability of the answer).

The next level is a fixed function of the answers before it, so a log folds to the same levels, and the likelihood of
the answers needs no correction. Levels end at the force cap; thresholds of the grid go beyond it, so that the posterior
can say that the threshold lies above the cap.

Source: L. L. Kontsevich, C. W. Tyler, Vision Res. 39 (1999), 2729-2737.
"""

import math
from dataclasses import dataclass
from functools import cache

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]

LEVEL_STEP_DB, LOWEST_DB = 1.0, -34.0
"""Spacing of the levels, and the lowest of them relative to the cap (dB)."""
BEYOND_DB = 12.0
"""Thresholds of the grid end this far (dB) above the cap and below the lowest level."""
SLOPES = tuple(float(slope) for slope in np.geomspace(0.8, 5.0, 7))
"""Slopes of the Weibull curve over newtons, equally probable a priori, spaced geometrically about 2. By hand."""
LAPSE_RATE = 0.02
"""Share of inattentive answers, half of them wrong: P(right) ends at 0.99, a lapse rate of 0.01 in the words of
`analysis.psychophysics.hierarchy.curve`. By hand: without it a single lapse at a high level could never be undone."""
TARGET = 0.5 ** (1 / 3)
"""Share of right answers at the threshold, lapses apart: that to which the published staircase converges."""
ENTROPY_TOLERANCE_NATS = 1e-9
"""Entropies (nats) closer than this are equal, and the lower level is played: rounding must not choose."""

Answered = tuple[float, bool]
"""Level in dB re 1 N, and whether the answer was right."""


@dataclass(frozen=True, slots=True)
class Estimate:
    """Estimate of the threshold, in dB re 1 N."""

    mean_db: float
    sd_db: float
    above_cap: float
    """Probability that it lies above the cap."""


@cache
def levels_db(cap_db: float) -> FloatArray:
    """(levels,), ascending: levels in dB re 1 N, LEVEL_STEP_DB apart; the last is the cap itself."""
    below = np.arange(round(-LOWEST_DB / LEVEL_STEP_DB), -1, -1, dtype=np.float64)
    return cap_db - LEVEL_STEP_DB * below


@cache
def thresholds_db(cap_db: float) -> FloatArray:
    """(thresholds,), ascending: thresholds of the grid in dB re 1 N, LEVEL_STEP_DB apart. cap_db: the cap in dB re 1
    N."""
    levels = levels_db(cap_db)
    return np.arange(float(levels[0]) - BEYOND_DB, cap_db + BEYOND_DB + LEVEL_STEP_DB / 2, LEVEL_STEP_DB)


def share_right(level_db: FloatArray, cap_db: float) -> FloatArray:
    """P(right) of every threshold and slope (..., thresholds, slopes) at levels of any shape (...), in dB re 1 N.

    A Weibull curve over newtons, F = 1 - exp(-exp(t0 + slope ln(10)/20 (level - threshold))), from 1/2 to 1:
    P = lapse / 2 + (1 - lapse) (1 + F) / 2, with t0 so that (1 + F) / 2 is `TARGET` at the threshold.
    """
    t0 = math.log(-math.log(2.0 - 2.0 * TARGET))
    above = np.asarray(level_db)[..., None, None] - thresholds_db(cap_db)[:, None]
    failure_share = 0.5 * np.exp(-np.exp(t0 + np.array(SLOPES) * (math.log(10.0) / 20.0) * above))
    return LAPSE_RATE / 2 + (1.0 - LAPSE_RATE) * (1.0 - failure_share)


def compute_posterior(answered: tuple[Answered, ...], cap_db: float) -> FloatArray:
    """Posterior probability of every threshold and slope (thresholds, slopes), from a flat prior."""
    log_p = np.zeros((len(thresholds_db(cap_db)), len(SLOPES)))
    for level_db, is_right in answered:
        p = share_right(np.array(level_db), cap_db)
        log_p += np.log(p if is_right else 1.0 - p)
    weight = np.exp(log_p - log_p.max())
    share: FloatArray = weight / weight.sum()
    return share


def next_level_db(probability: FloatArray, cap_db: float) -> float:
    """The level (dB re 1 N) after which the least entropy of threshold and slope is expected; never above the cap.
    probability: (thresholds, slopes), as `compute_posterior` gives it."""
    levels, right_share = levels_db(cap_db), _tabulate_share_right(cap_db)
    expected_entropy = np.zeros(len(levels))
    for table in (right_share, 1.0 - right_share):
        joint = table * probability
        chance = joint.sum(axis=(1, 2))
        # Entropy of the posterior times its chance: -sum of joint log(joint / chance).
        expected_entropy -= (joint * np.log(np.maximum(joint, 1e-300))).sum(axis=(1, 2)) - chance * np.log(chance)
    return float(levels[int(np.flatnonzero(expected_entropy <= expected_entropy.min() + ENTROPY_TOLERANCE_NATS)[0])])


def estimate_threshold(probability: FloatArray, cap_db: float) -> Estimate:
    """Mean and standard deviation of the threshold's marginal posterior, and its probability above the cap.
    probability: (thresholds, slopes), as `compute_posterior` gives it."""
    thresholds, by_threshold = thresholds_db(cap_db), probability.sum(axis=1)
    mean = float((by_threshold * thresholds).sum())
    variance = float((by_threshold * (thresholds - mean) ** 2).sum())
    return Estimate(mean, math.sqrt(variance), float(by_threshold[thresholds > cap_db].sum()))


@cache
def _tabulate_share_right(cap_db: float) -> FloatArray:
    return share_right(levels_db(cap_db), cap_db)
