"""A participant who feels the direction, more or less well.

One presentation, two answers: identification, not a choice between two intervals. With e normal around +d'/2 for
direction 1 and -d'/2 for direction 2, spread 1, answer 1 is given where e > criterion. Unbiased, the share of
right answers is Phi(d'/2), so d' = 2 Phi^-1(share of the Weibull curve); a criterion lowers the share at equal d'.

In a detection trial the two are intervals, and what counts is whether the vibration is felt at all: the same model
over a curve of its own, far below the one for directions.

Source: N. A. Macmillan, C. D. Creelman, Detection Theory: A User's Guide, 2nd ed. (2005), chapters 1 and 2.
"""

import math
from dataclasses import dataclass
from statistics import NormalDist

from protocols.trial import Phase
from study.participants.chance import response_time_s, uniform
from study.participants.detection import DETECTION_SLOPE, TYPICAL_DETECTION_N
from study.participants.observer import Felt, Reply
from study.participants.psychometric_curve import WeibullCurve, threshold_at

_NORMAL = NormalDist()


@dataclass(frozen=True, slots=True)
class DirectionFeeler:
    name: str
    thresholds_n: tuple[tuple[float, float], ...]
    """(frequency in Hz, level in N with 79.37 % of the directions right), frequencies ascending."""
    slope: float = 2.0
    """Of the Weibull curve over newtons; people's lie between 1 and 3.5."""
    lapse: float = 0.0
    """Share of wrong answers that is left at the strongest level; such answers are a coin's, for twice this share."""
    criterion: float = 0.0
    """c of Macmillan and Creelman, as in `psychophysics.bias`: positive, a tendency to answer 2; negative, to 1."""
    drift_db_per_100_trials: float = 0.0
    """By how much the thresholds rise as the session goes on."""
    numb_above_hz: float = math.inf
    """Above this frequency the direction is not felt at all; the vibration is."""
    detection_n: tuple[tuple[float, float], ...] = TYPICAL_DETECTION_N
    """(frequency in Hz, level in N at which the vibration's interval is found 79.37 % of the time)."""

    def reply(self, felt: Felt, seed: int) -> Reply:
        luck, delay = uniform(felt, seed, 2)
        answer = 1 if luck < self.share_of_1(felt) else 2
        return Reply(answer, response_time_s(delay))

    def share_of_1(self, felt: Felt) -> float:
        """Probability of answer 1."""
        sign = 1.0 if felt.direction_shown == 1 else -1.0
        certain = _NORMAL.cdf(sign * self._d_prime(felt) / 2 - self.criterion)
        return self.lapse + (1.0 - 2.0 * self.lapse) * certain

    def share_right(self, felt: Felt) -> float:
        share_of_1 = self.share_of_1(felt)
        return share_of_1 if felt.direction_shown == 1 else 1.0 - share_of_1

    def _d_prime(self, felt: Felt) -> float:
        detection = felt.phase is Phase.DETECTION
        if felt.frequency_hz > self.numb_above_hz and not detection:
            return 0.0
        drift_db = self.drift_db_per_100_trials * felt.trials_before / 100.0
        thresholds_n = self.detection_n if detection else self.thresholds_n
        threshold_n = threshold_at(thresholds_n, felt.frequency_hz) * 10.0 ** (drift_db / 20.0)
        slope = DETECTION_SLOPE if detection else self.slope
        return WeibullCurve(threshold_n, slope).distance(felt.level_n)
