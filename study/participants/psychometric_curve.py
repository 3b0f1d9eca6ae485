"""The share of right answers against the level, for choosing one of two: directions, or intervals."""

import math
from dataclasses import dataclass
from itertools import pairwise
from statistics import NormalDist

TARGET = 0.5 ** (1 / 3)
"""Where one wrong and three right answers in a row are equally likely: 79.37 % right (Levitt 1971)."""


@dataclass(frozen=True, slots=True)
class WeibullCurve:
    """0.5 + 0.5 F(x) with F(x) = 1 - exp(-(x / a)^slope), a chosen so that `threshold_n` gives TARGET."""

    threshold_n: float
    slope: float

    def share_right(self, level_n: float) -> float:
        return 1.0 - 0.5 * math.exp(-_AT_TARGET * (level_n / self.threshold_n) ** self.slope)

    def distance(self, level_n: float) -> float:
        """Between the two alternatives, in standard deviations of the evidence, for this share without a bias."""
        return 2.0 * NormalDist().inv_cdf(min(self.share_right(level_n), _SUREST))


_SUREST = 1.0 - 1e-12
"""The inverse of the normal distribution ends before 1."""

_AT_TARGET = -math.log(2.0 * (1.0 - TARGET))
"""(x / a)^slope at the threshold."""


def threshold_at(thresholds_n: tuple[tuple[float, float], ...], frequency_hz: float) -> float:
    """Threshold at any frequency from (frequency in Hz, threshold in N) in ascending order: straight lines on
    logarithmic axes, level beyond the ends."""
    if frequency_hz <= thresholds_n[0][0]:
        return thresholds_n[0][1]
    for (low_hz, low_n), (high_hz, high_n) in pairwise(thresholds_n):
        if frequency_hz <= high_hz:
            share = math.log(frequency_hz / low_hz) / math.log(high_hz / low_hz)
            return float(low_n * (high_n / low_n) ** share)
    return thresholds_n[-1][1]
