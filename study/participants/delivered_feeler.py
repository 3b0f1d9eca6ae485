"""Simulated participant who feels what the device delivered, not what was commanded.

The direction is felt as far as the motion has one: motion along the direction counts, motion across it takes away, and
where both are equally strong (a circle) there is no direction left. So the felt amplitude is sqrt(along^2 - across^2).
Harmonics mask: they add to the threshold as independent noise does, in squares. Vibration numbs: the threshold rises
within a run and is back after the rest.

The rest is signal detection over a Weibull curve in m/s², as with `direction_feeler`: thresholds there, in newtons,
times what the simulated omega.3 delivers per newton. All numbers are assumptions of ours. Before anything was measured
(no device, less than a period, a detection trial) the commanded level counts as delivered without a flaw.
"""

import math
from dataclasses import dataclass, replace

from protocols.trial import Phase
from study.participants.direction_feeler import DirectionFeeler
from study.participants.observer import PerceivedStimulus, Reply
from study.participants.psychometric_curve import threshold_at

MPS2_PER_N = ((5.0, 1.5), (15.0, 2.7), (25.0, 2.85), (35.0, 3.1), (45.0, 3.6))
"""(Hz, m/s² per N) along a direction: medians of four rehearsed sessions near the thresholds there."""


@dataclass(frozen=True, slots=True)
class DeliveredFeeler:
    """An `Observer` who answers to the measured acceleration, converted to an equivalent force for `feeler`."""

    name: str
    feeler: DirectionFeeler
    """Thresholds, slope, lapses and criterion."""
    masking: float = 1.0
    """Factor by which a harmonic amplitude adds to the threshold, in squares; 0: not at all."""
    adaptation_db: float = 1.0
    """Rise of the threshold in a long run."""
    adaptation_trials: float = 20.0
    """Time constant of adaptation, in trials of a run."""

    def reply(self, felt: PerceivedStimulus, seed: int) -> Reply:
        """The answer to one presentation."""
        return self.feeler.reply(replace(felt, level_n=self.felt_n(felt)), seed)

    def share_right(self, felt: PerceivedStimulus) -> float:
        """Probability of the right answer."""
        return self.feeler.share_right(replace(felt, level_n=self.felt_n(felt)))

    def felt_n(self, felt: PerceivedStimulus) -> float:
        """The commanded force that would be told as well, delivered without a flaw and before any adaptation."""
        delivered = felt.delivered
        if felt.phase is Phase.DETECTION or delivered is None:
            return felt.level_n
        per_newton = threshold_at(MPS2_PER_N, felt.frequency_hz)
        threshold_mps2 = per_newton * threshold_at(self.feeler.thresholds_n, felt.frequency_hz)
        directed = math.sqrt(max(0.0, delivered.along_mps2**2 - delivered.off_axis_mps2**2))
        raised = math.hypot(1.0, self.masking * (delivered.harmonics_mps2 or 0.0) / threshold_mps2)
        numb_db = self.adaptation_db * -math.expm1(-felt.trial / self.adaptation_trials)
        return directed / per_newton / raised * float(10.0 ** (-numb_db / 20.0))
