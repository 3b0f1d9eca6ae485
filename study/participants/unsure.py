"""Simulated participant who asks for the same trial again when unsure, and decides on all looks together.

Every look gives evidence for direction 1 or 2, normal around +d'/2 or -d'/2 with unit standard deviation; looks are
independent and are averaged, so two of them tell as much as d' sqrt(2). The participant asks again where the average
lies within `unsure` standard errors of the criterion. Its looks follow from the number of the attempt, so that the
participant stays stateless.
"""

import math
from dataclasses import dataclass, replace
from statistics import NormalDist

from study.participants.chance import response_time_s, uniform
from study.participants.direction_feeler import DirectionFeeler
from study.participants.observer import PerceivedStimulus, Reply

_NORMAL = NormalDist()
"""Standard normal distribution."""


@dataclass(frozen=True, slots=True)
class UnsureRepeater:
    """An `Observer` who asks for a repetition where the evidence is near the criterion."""

    name: str
    feeler: DirectionFeeler
    unsure: float = 0.5
    """Threshold of doubt in standard errors of the averaged evidence: 0.5 asks again in about 30 % of the trials near
    the threshold."""
    looks: int = 5
    """Most presentations of one trial; then it is answered in any case."""

    def reply(self, felt: PerceivedStimulus, seed: int) -> Reply:
        """The answer on all looks so far, and whether another is asked for."""
        delay, lapsed, coin = uniform(felt, seed, 4)[1:]
        evidence = self._evidence(felt, seed)
        answer = 1 if evidence > 0.0 else 2
        if lapsed < 2.0 * self.feeler.lapse:
            return Reply(1 if coin < 0.5 else 2, response_time_s(delay))
        ask_again = abs(evidence) < self.unsure and felt.attempt + 1 < self.looks
        return Reply(answer, response_time_s(delay), ask_again)

    def _evidence(self, felt: PerceivedStimulus, seed: int) -> float:
        """Average of all looks minus the criterion, in standard errors."""
        sign = 1.0 if felt.direction_shown == 1 else -1.0
        middle = sign * self.feeler.d_prime(felt) / 2.0 - self.feeler.criterion_at(felt)
        luck = [uniform(replace(felt, attempt=look), seed, 1)[0] for look in range(felt.attempt + 1)]
        return sum(middle + _NORMAL.inv_cdf(each) for each in luck) / math.sqrt(len(luck))
