"""Psychometric function of a task with two alternatives: fraction of right answers as a function of level (Weibull).
Used by the simulated participants (`direction_feeler`, `intensity_cue`)."""

import math
from dataclasses import dataclass
from itertools import pairwise
from statistics import NormalDist

TARGET_FRACTION = 0.5 ** (1 / 3)
"""Convergence point of the one-up three-down rule: 79.37 % right (H. Levitt, J. Acoust. Soc. Am. 49 (1971),
467-477)."""


@dataclass(frozen=True, slots=True)
class WeibullCurve:
    """Fraction right = 0.5 + 0.5 F(x) with F(x) = 1 - exp(-(x / a)^slope), x the level (N); a is chosen so that
    `threshold_n` (N) gives TARGET_FRACTION."""

    threshold_n: float
    slope: float

    def compute_right_share(self, level_n: float) -> float:
        """Fraction of right answers at this level (N)."""
        return 1.0 - 0.5 * math.exp(-_EXPONENT_AT_TARGET * (level_n / self.threshold_n) ** self.slope)

    def compute_d_prime(self, level_n: float) -> float:
        """d' (distance of the two alternatives in standard deviations) that gives this fraction without bias: d' = 2
        Phi^-1(fraction)."""
        return 2.0 * NormalDist().inv_cdf(min(self.compute_right_share(level_n), _MAX_FRACTION))


_MAX_FRACTION = 1.0 - 1e-12
"""Largest fraction that is inserted in the inverse normal distribution, which is infinite at 1."""

_EXPONENT_AT_TARGET = -math.log(2.0 * (1.0 - TARGET_FRACTION))
"""Value of (x / a)^slope at the threshold: -ln(2 (1 - TARGET_FRACTION))."""


def interpolate_threshold_n(thresholds_n: tuple[tuple[float, float], ...], frequency_hz: float) -> float:
    """Threshold (N) at any frequency from (Hz, N) pairs in ascending order: linear on logarithmic axes, constant
    beyond the ends."""
    if frequency_hz <= thresholds_n[0][0]:
        return thresholds_n[0][1]
    for (low_hz, low_n), (high_hz, high_n) in pairwise(thresholds_n):
        if frequency_hz <= high_hz:
            fraction = math.log(frequency_hz / low_hz) / math.log(high_hz / low_hz)
            return float(low_n * (high_n / low_n) ** fraction)
    return thresholds_n[-1][1]
