"""Simulated participant without a sense of direction, who uses the difference in strength between the directions.

A device rarely delivers both directions equally strongly. A participant who remembers the average strength at this
level can answer 1 for a stronger and 2 for a weaker vibration. The level changes rarely, so the memory is assumed
perfect, which gives an upper bound of this cue.

Model: the felt strength in dB is normal around +difference_db/2 (direction 1) or -difference_db/2 (direction 2)
relative to the memory, with standard deviation noise_db sqrt(1 + (detection_n / level)^2): a constant Weber fraction
well above the detection level, and rising noise towards it. Therefore d' = difference_db / standard deviation; without
a difference the answers are at chance. With roving, the change of level in dB is added to the felt strength, while the
memory remains that of the staircase's level: the strength then depends on the random level as well as on the direction.

In detection trials the participant is like the others, with `detection_n` as threshold.
"""

import math
from dataclasses import dataclass
from statistics import NormalDist

from protocols.trial import Phase
from study.participants.detection_thresholds import DETECTION_SLOPE
from study.participants.observer import PerceivedStimulus, Reply
from study.participants.psychometric_curve import WeibullCurve
from study.participants.random_draws import draw_response_time_s, draw_uniform


@dataclass(frozen=True, slots=True)
class IntensityCue:
    """An `Observer` who distinguishes the two directions only by the strength of the vibration."""

    name: str
    difference_db: float = 3.0
    """Delivered level of the direction with the number 1 on the screen, relative to the other direction (dB). An
    assumption."""
    noise_db: float = 1.0
    """Standard deviation of one judgement of strength (dB). An assumption: of the size of the difference limen of
    vibration."""
    detection_n: float = 0.1
    """Threshold of detection, and level at which the noise is `noise_db` times the square root of two (N)."""

    def reply(self, felt: PerceivedStimulus, seed: int) -> Reply:
        """Draw the answer (1 or 2) and response time (s) for one presentation, random but the same for equal
        arguments."""
        choice_draw, time_draw = draw_uniform(felt, seed, 2)
        sign = 1.0 if felt.direction_shown == 1 else -1.0
        detection_curve = WeibullCurve(self.detection_n, DETECTION_SLOPE)
        compute_sensitivity = detection_curve.compute_d_prime if felt.phase is Phase.DETECTION else self.compute_d_prime
        probability_of_1 = NormalDist().cdf(
            sign * compute_sensitivity(felt.level_n) / 2 + self._compute_rove_deviation(felt)
        )
        return Reply(1 if choice_draw < probability_of_1 else 2, draw_response_time_s(time_draw))

    def _compute_rove_deviation(self, felt: PerceivedStimulus) -> float:
        """Compute the change of the felt strength by roving (dB) over its standard deviation (dB); 0 without roving and
        in detection trials."""
        if felt.nominal_n is None or felt.phase is Phase.DETECTION:
            return 0.0
        return 20.0 * math.log10(felt.level_n / felt.nominal_n) / self._compute_noise_db(felt.level_n)

    def _compute_noise_db(self, level_n: float) -> float:
        """Compute the standard deviation (dB) of the felt strength at this level (N), which must be above 0."""
        return self.noise_db * math.hypot(1.0, self.detection_n / level_n)

    def compute_d_prime(self, level_n: float) -> float:
        """Compute the sensitivity d' for the direction at this level (N)."""
        return self.difference_db / self._compute_noise_db(level_n)
