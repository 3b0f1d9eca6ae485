"""Random numbers of simulated participants, keyed by trial: the same trial of the same session gets the same draws."""

import math
from statistics import NormalDist

import numpy as np

from study.participants.observer import PerceivedStimulus

_MEDIAN_RESPONSE_S = math.sqrt(1.2 * 2.5)
"""Median response time (s): the geometric mean of 1.2 s and 2.5 s."""
_SPREAD_OF_LOG = math.log(2.5 / 1.2) / (2 * 1.96)
"""Standard deviation of the logarithm of the response time: 95 % of the times lie between 1.2 and 2.5 s."""

_OBSERVERS = 0x0B5E
"""Separates these random numbers from those of the schedule. With a shared seed, the draws of a participant would
otherwise be correlated with the directions."""


def draw_uniform(felt: PerceivedStimulus, seed: int, count: int) -> tuple[float, ...]:
    """`count` independent draws, uniform in (0, 1), for one presentation. seed: of the session."""
    key = (_OBSERVERS, felt.run, felt.trial, felt.attempt)
    words = np.random.SeedSequence(entropy=seed, spawn_key=key).generate_state(count, np.uint64)
    return tuple(((int(word) >> 11) + 0.5) * 2.0**-53 for word in words)


def draw_response_time_s(draw: float) -> float:
    """Log-normal response time (s). draw: uniform in (0, 1)."""
    return _MEDIAN_RESPONSE_S * math.exp(_SPREAD_OF_LOG * NormalDist().inv_cdf(draw))
