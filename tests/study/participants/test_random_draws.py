"""Random numbers of simulated participants."""

import numpy as np

from protocols.trial import Phase
from study.participants import random_draws
from study.participants.observer import PerceivedStimulus


def test_the_smallest_and_the_largest_word_have_a_response_time(monkeypatch):
    class Extremes:
        def __init__(self, **key) -> None: ...

        def generate_state(self, count, dtype):
            return np.array([0, 2**64 - 1], dtype)

    monkeypatch.setattr(np.random, "SeedSequence", Extremes)
    felt = PerceivedStimulus(0, 0, 0, Phase.TEST, 15.0, 0.6, 1, 0)
    least, most = (random_draws.draw_response_time_s(draw) for draw in random_draws.draw_uniform(felt, 1, 2))
    assert 0.0 < least < most < 60.0
