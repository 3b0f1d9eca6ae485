"""Simulated participant with a direction threshold: signal detection theory with a Weibull psychometric function.

A trial is one presentation with two possible answers (identification, not a choice between intervals). The evidence is
normal around +d'/2 for direction 1 and -d'/2 for direction 2 with unit standard deviation; answer 1 is given above the
criterion. Without bias the fraction of right answers is Phi(d'/2), so d' = 2 Phi^-1(fraction of the Weibull curve).
With a criterion c it is Phi(d'/2 - c) for direction 1 and Phi(d'/2 + c) for direction 2, which is less on average.

In a detection trial the alternatives are two intervals; the same model is used with the detection curve, whose levels
are much lower.

Source: N. A. Macmillan, C. D. Creelman, Detection Theory: A User's Guide, 2nd ed. (2005), chapters 1 and 2.
"""

import math
from dataclasses import dataclass
from statistics import NormalDist

from protocols.trial import Phase
from study.participants.detection_thresholds import DETECTION_SLOPE, TYPICAL_DETECTION_N
from study.participants.observer import PerceivedStimulus, Reply
from study.participants.psychometric_curve import WeibullCurve, interpolate_threshold_n
from study.participants.random_draws import draw_response_time_s, draw_uniform

_NORMAL = NormalDist()
"""Standard normal distribution."""


@dataclass(frozen=True, slots=True)
class DirectionFeeler:
    """An `Observer` with direction and detection thresholds that depend on frequency."""

    name: str
    thresholds_n: tuple[tuple[float, float], ...]
    """(frequency in Hz, level in N at which 79.37 % of the directions are right), frequencies ascending."""
    slope: float = 2.0
    """Slope (exponent) of the Weibull function of force in direction trials, without unit. The default is chosen,
    within the 1 to 3.5 that are typical for people."""
    lapse: float = 0.0
    """Lapse rate: fraction of wrong answers at the strongest level. Random answers occur at twice this rate, half of
    them right."""
    criterion: float = 0.0
    """c of Macmillan and Creelman, in standard deviations of the evidence, as in `psychophysics.bias`: positive for a
    tendency to answer 2, negative for 1."""
    drift_db_per_100_trials: float = 0.0
    """Rise of the thresholds during the session (dB per 100 answered trials)."""
    criterion_per_100_trials: float = 0.0
    """Drift of the criterion during the session (standard deviations per 100 answered trials)."""
    numb_above_hz: float = math.inf
    """Frequency (Hz) above which the direction is not felt, although the vibration is."""
    detection_n: tuple[tuple[float, float], ...] = TYPICAL_DETECTION_N
    """(frequency in Hz, level in N at which the interval of the vibration is found in 79.37 % of the trials),
    frequencies ascending."""

    def reply(self, felt: PerceivedStimulus, seed: int) -> Reply:
        """Draw the answer (1 or 2) and response time (s) for one presentation, random but the same for equal
        arguments."""
        choice_draw, time_draw = draw_uniform(felt, seed, 2)
        answer = 1 if choice_draw < self.compute_probability_of_answer_1(felt) else 2
        return Reply(answer, draw_response_time_s(time_draw))

    def compute_probability_of_answer_1(self, felt: PerceivedStimulus) -> float:
        """Compute the probability of answer 1, lapses included."""
        sign = 1.0 if felt.direction_shown == 1 else -1.0
        probability_without_lapses = _NORMAL.cdf(sign * self.compute_d_prime(felt) / 2 - self.compute_criterion(felt))
        return self.lapse + (1.0 - 2.0 * self.lapse) * probability_without_lapses

    def compute_proportion_correct(self, felt: PerceivedStimulus) -> float:
        """Compute the probability of the right answer, lapses included."""
        probability_of_1 = self.compute_probability_of_answer_1(felt)
        return probability_of_1 if felt.direction_shown == 1 else 1.0 - probability_of_1

    def compute_criterion(self, felt: PerceivedStimulus) -> float:
        """Compute the criterion c (standard deviations) at this trial, with its drift."""
        return self.criterion + self.criterion_per_100_trials * felt.trials_before / 100.0

    def compute_d_prime(self, felt: PerceivedStimulus) -> float:
        """Compute the sensitivity d' to this stimulus; 0 above `numb_above_hz`, where the direction is not felt, except
        in a detection trial."""
        is_detection = felt.phase is Phase.DETECTION
        if felt.frequency_hz > self.numb_above_hz and not is_detection:
            return 0.0
        drift_db = self.drift_db_per_100_trials * felt.trials_before / 100.0
        thresholds_n = self.detection_n if is_detection else self.thresholds_n
        threshold_n = interpolate_threshold_n(thresholds_n, felt.frequency_hz) * 10.0 ** (drift_db / 20.0)
        slope = DETECTION_SLOPE if is_detection else self.slope
        return WeibullCurve(threshold_n, slope).compute_d_prime(felt.level_n)
