"""Simulated participant who answers to the acceleration that the device delivered, not to the commanded force.

Model. Let a and c be the delivered amplitudes along and across the played direction, h that of the harmonics (m/s²), k
the index of the trial within the run, from 0, and T the undisturbed direction threshold (m/s²). The participant answers
as a `direction_feeler` would to the amplitude

    sqrt(a² - c²) / sqrt(1 + (m h / T)²) · 10^(-A (1 - exp(-k / tau)) / 20)

* Direction: motion across the played direction reduces the sense of it; for c = a (a circle) no direction is felt.
* Masking: harmonics act as independent noise with weight m; the threshold becomes sqrt(T² + (m h)²).
* Adaptation: the threshold rises by up to A dB within a run, and begins at T again in the next run.

The amplitude is converted to newtons by what the simulated omega.3 delivers per newton (`MPS2_PER_N`), because the
thresholds of `direction_feeler` are forces. The model and its numbers m, A and tau are assumptions of the authors.
Where nothing was measured (no device, less than a period, a detection trial), the commanded force counts as delivered
without disturbance, and adaptation is left out.
"""

import math
from dataclasses import dataclass, replace

from protocols.trial import Phase
from study.participants.direction_feeler import DirectionFeeler
from study.participants.observer import PerceivedStimulus, Reply
from study.participants.psychometric_curve import interpolate_threshold_n

MPS2_PER_N = ((5.0, 1.5), (15.0, 2.7), (25.0, 2.85), (35.0, 3.1), (45.0, 3.6))
"""(Hz, m/s² per N): acceleration along a direction that the simulated omega.3 delivers per newton; medians of four
rehearsed sessions at levels near the thresholds. Interpolated on logarithmic axes, constant beyond the ends."""


@dataclass(frozen=True, slots=True)
class DeliveredFeeler:
    """An `Observer` who answers to the measured acceleration, converted to an equivalent force for `feeler`."""

    name: str
    feeler: DirectionFeeler
    """Thresholds, slope, lapses and criterion."""
    masking: float = 1.0
    """m: weight of the amplitude of the harmonics in the threshold; 0: harmonics do not mask."""
    adaptation_db: float = 1.0
    """A: rise of the threshold in a long run (dB)."""
    adaptation_trials: float = 20.0
    """tau: time constant of adaptation, in trials of a run."""

    def reply(self, felt: PerceivedStimulus, seed: int) -> Reply:
        """Draw the answer (1 or 2) and response time (s) for one presentation, as `feeler` does for the equivalent
        force."""
        return self.feeler.reply(replace(felt, level_n=self.compute_equivalent_force_n(felt)), seed)

    def compute_proportion_correct(self, felt: PerceivedStimulus) -> float:
        """Compute the probability of the right answer, lapses included."""
        return self.feeler.compute_proportion_correct(replace(felt, level_n=self.compute_equivalent_force_n(felt)))

    def compute_equivalent_force_n(self, felt: PerceivedStimulus) -> float:
        """Compute the force (N) which, delivered without disturbance and before adaptation, would be felt as well as
        this stimulus; 0 where the motion across is not less than that along the direction."""
        delivered = felt.delivered
        if felt.phase is Phase.DETECTION or delivered is None:
            return felt.level_n
        mps2_per_n = interpolate_threshold_n(MPS2_PER_N, felt.frequency_hz)
        threshold_mps2 = mps2_per_n * interpolate_threshold_n(self.feeler.thresholds_n, felt.frequency_hz)
        directed_mps2 = math.sqrt(max(0.0, delivered.along_mps2**2 - delivered.off_axis_mps2**2))
        masking_factor = math.hypot(1.0, self.masking * (delivered.harmonics_mps2 or 0.0) / threshold_mps2)
        adaptation_rise_db = self.adaptation_db * -math.expm1(-felt.trial / self.adaptation_trials)
        return directed_mps2 / mps2_per_n / masking_factor * float(10.0 ** (-adaptation_rise_db / 20.0))
