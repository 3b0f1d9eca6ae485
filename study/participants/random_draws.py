"""Random numbers of simulated participants, keyed by seed, run, trial and attempt, so that they can be drawn again."""

import math
from statistics import NormalDist

import numpy as np

from study.participants.observer import PerceivedStimulus

_MEDIAN_RESPONSE_S = math.sqrt(1.2 * 2.5)
"""Median response time (s): the geometric mean of 1.2 s and 2.5 s. Chosen."""
_LOG_RESPONSE_SD = math.log(2.5 / 1.2) / (2 * 1.96)
"""Standard deviation of the natural logarithm of the response time: 95 % (+-1.96 standard deviations) of the times lie
between 1.2 s and 2.5 s. Chosen."""

_OBSERVER_STREAM = 0x0B5E
"""Arbitrary key that separates these random numbers from those of the schedule. With a shared seed, the draws of a
participant would otherwise be correlated with the directions."""


def draw_uniform(stimulus: PerceivedStimulus, seed: int, count: int) -> tuple[float, ...]:
    """Draw `count` independent numbers, uniform in (0, 1), for one presentation. seed: of the session."""
    key = (_OBSERVER_STREAM, stimulus.run, stimulus.trial, stimulus.attempt)
    random_words = np.random.SeedSequence(entropy=seed, spawn_key=key).generate_state(count, np.uint64)
    # 53 random bits, the precision of a float; the half keeps 0 out, and the minimum 1, to which the largest word is
    # rounded: their normal quantiles are infinite.
    return tuple(min(((int(word) >> 11) + 0.5) * 2.0**-53, 1.0 - 2.0**-53) for word in random_words)


def draw_response_time_s(uniform_draw: float) -> float:
    """Convert a number that is uniform in (0, 1) to a log-normal response time (s)."""
    return _MEDIAN_RESPONSE_S * math.exp(_LOG_RESPONSE_SD * NormalDist().inv_cdf(uniform_draw))
