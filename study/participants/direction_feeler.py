"""Simulated participant with a direction threshold: signal detection theory over a Weibull curve.

One presentation, two possible answers (identification, not a choice between intervals). The evidence is normal around
+d'/2 for direction 1 and -d'/2 for direction 2 with unit standard deviation; answer 1 is given above the criterion.
Without bias the fraction of right answers is Phi(d'/2), so d' = 2 Phi^-1(fraction of the Weibull curve); a criterion
lowers the fraction at equal d'.

In a detection trial the alternatives are two intervals: the same model with the detection curve, at much lower levels.

Source: N. A. Macmillan, C. D. Creelman, Detection Theory: A User's Guide, 2nd ed. (2005), chapters 1 and 2.
"""

import math
from dataclasses import dataclass
from statistics import NormalDist

from protocols.trial import Phase
from study.participants.chance import response_time_s, uniform
from study.participants.detection import DETECTION_SLOPE, TYPICAL_DETECTION_N
from study.participants.observer import PerceivedStimulus, Reply
from study.participants.psychometric_curve import WeibullCurve, threshold_at

_NORMAL = NormalDist()
"""Standard normal distribution."""


@dataclass(frozen=True, slots=True)
class DirectionFeeler:
    """An `Observer` with thresholds for the direction over frequency."""

    name: str
    thresholds_n: tuple[tuple[float, float], ...]
    """(frequency in Hz, level in N with 79.37 % of the directions right), frequencies ascending."""
    slope: float = 2.0
    """Slope of the Weibull function over newtons; people's are between 1 and 3.5."""
    lapse: float = 0.0
    """Fraction of wrong answers at the strongest level; lapses are random answers, at twice this rate."""
    criterion: float = 0.0
    """c of Macmillan and Creelman, as in `psychophysics.bias`: positive, a tendency to answer 2; negative, to 1."""
    drift_db_per_100_trials: float = 0.0
    """Rise of the thresholds during the session."""
    criterion_per_100_trials: float = 0.0
    """Drift of the criterion during the session."""
    numb_above_hz: float = math.inf
    """Above this frequency the direction is not felt; the vibration is."""
    detection_n: tuple[tuple[float, float], ...] = TYPICAL_DETECTION_N
    """(frequency in Hz, level in N at which the vibration's interval is found 79.37 % of the time)."""

    def reply(self, felt: PerceivedStimulus, seed: int) -> Reply:
        """The answer to one presentation."""
        luck, delay = uniform(felt, seed, 2)
        answer = 1 if luck < self.share_of_1(felt) else 2
        return Reply(answer, response_time_s(delay))

    def share_of_1(self, felt: PerceivedStimulus) -> float:
        """Probability of answer 1."""
        sign = 1.0 if felt.direction_shown == 1 else -1.0
        certain = _NORMAL.cdf(sign * self.d_prime(felt) / 2 - self.criterion_at(felt))
        return self.lapse + (1.0 - 2.0 * self.lapse) * certain

    def share_right(self, felt: PerceivedStimulus) -> float:
        """Probability of the right answer."""
        share_of_1 = self.share_of_1(felt)
        return share_of_1 if felt.direction_shown == 1 else 1.0 - share_of_1

    def criterion_at(self, felt: PerceivedStimulus) -> float:
        """c at this trial."""
        return self.criterion + self.criterion_per_100_trials * felt.trials_before / 100.0

    def d_prime(self, felt: PerceivedStimulus) -> float:
        """Sensitivity to this stimulus."""
        detection = felt.phase is Phase.DETECTION
        if felt.frequency_hz > self.numb_above_hz and not detection:
            return 0.0
        drift_db = self.drift_db_per_100_trials * felt.trials_before / 100.0
        thresholds_n = self.detection_n if detection else self.thresholds_n
        threshold_n = threshold_at(thresholds_n, felt.frequency_hz) * 10.0 ** (drift_db / 20.0)
        slope = DETECTION_SLOPE if detection else self.slope
        return WeibullCurve(threshold_n, slope).distance(felt.level_n)
