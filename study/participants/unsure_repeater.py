"""Simulated participant who asks for a repetition of a trial when unsure, and decides on all its presentations.

Signal detection theory with multiple looks: each presentation (look) gives evidence, normal around +d'/2 for direction
1 and -d'/2 for direction 2 with unit standard deviation. Looks are independent and averaged, so that n looks have the
sensitivity d' sqrt(n). The participant asks again where the average lies within `unsure_distance` standard errors of
the criterion. The evidence of earlier looks is drawn again from the numbers of their attempts, so that no state is
kept.
"""

import math
from dataclasses import dataclass, replace
from statistics import NormalDist

from study.participants.direction_feeler import DirectionFeeler
from study.participants.observer import PerceivedStimulus, Reply
from study.participants.random_draws import draw_response_time_s, draw_uniform

_NORMAL = NormalDist()
"""Standard normal distribution."""


@dataclass(frozen=True, slots=True)
class UnsureRepeater:
    """An `Observer` who asks for a repetition where the evidence is near the criterion, up to `max_looks`."""

    name: str
    feeler: DirectionFeeler
    """Thresholds, criterion and lapse rate of the participant."""
    unsure_distance: float = 0.5
    """Largest distance of the averaged evidence from the criterion, in standard errors, at which the participant asks
    again: at 0.5, after about 30 % of the first looks near the threshold. Chosen."""
    max_looks: int = 5
    """Largest number of presentations of one trial; after the last, the answer is final. Chosen."""

    def reply(self, felt: PerceivedStimulus, seed: int) -> Reply:
        """Answer from all looks so far, and decide whether to ask for another one. A lapse is a random answer
        without asking again; its probability is twice `lapse`, because half of such answers are right."""
        # The first of the four numbers is the evidence of this look (`_compute_evidence`).
        time_draw, lapse_draw, answer_draw = draw_uniform(felt, seed, 4)[1:]
        evidence = self._compute_evidence(felt, seed)
        answer = 1 if evidence > 0.0 else 2
        if lapse_draw < 2.0 * self.feeler.lapse:
            return Reply(1 if answer_draw < 0.5 else 2, draw_response_time_s(time_draw))
        ask_again = abs(evidence) < self.unsure_distance and felt.attempt + 1 < self.max_looks
        return Reply(answer, draw_response_time_s(time_draw), ask_again)

    def _compute_evidence(self, felt: PerceivedStimulus, seed: int) -> float:
        """Compute the average evidence of all looks minus the criterion, in standard errors of the average."""
        sign = 1.0 if felt.direction_shown == 1 else -1.0
        mean_evidence = sign * self.feeler.compute_d_prime(felt) / 2.0 - self.feeler.compute_criterion(felt)
        uniform_draws = [draw_uniform(replace(felt, attempt=look), seed, 1)[0] for look in range(felt.attempt + 1)]
        return sum(mean_evidence + _NORMAL.inv_cdf(draw) for draw in uniform_draws) / math.sqrt(len(uniform_draws))
