"""Psychometric function of a two-alternative task: fraction of right answers over level."""

import math
from dataclasses import dataclass
from itertools import pairwise
from statistics import NormalDist

TARGET = 0.5 ** (1 / 3)
"""Convergence point of the one-up three-down rule: 79.37 % right (Levitt 1971)."""


@dataclass(frozen=True, slots=True)
class WeibullCurve:
    """Fraction right = 0.5 + 0.5 F(x) with F(x) = 1 - exp(-(x / a)^slope); a is chosen so that `threshold_n` gives
    TARGET."""

    threshold_n: float
    slope: float

    def share_right(self, level_n: float) -> float:
        """Fraction of right answers at this level (N)."""
        return 1.0 - 0.5 * math.exp(-_AT_TARGET * (level_n / self.threshold_n) ** self.slope)

    def distance(self, level_n: float) -> float:
        """d' (distance of the two alternatives in standard deviations) that gives this fraction without bias."""
        return 2.0 * NormalDist().inv_cdf(min(self.share_right(level_n), _SUREST))


_SUREST = 1.0 - 1e-12
"""Largest fraction for which the inverse normal distribution is finite."""

_AT_TARGET = -math.log(2.0 * (1.0 - TARGET))
"""(x / a)^slope at the threshold."""


def threshold_at(thresholds_n: tuple[tuple[float, float], ...], frequency_hz: float) -> float:
    """Threshold (N) at any frequency from (Hz, N) pairs in ascending order: linear on logarithmic axes, constant
    beyond the ends."""
    if frequency_hz <= thresholds_n[0][0]:
        return thresholds_n[0][1]
    for (low_hz, low_n), (high_hz, high_n) in pairwise(thresholds_n):
        if frequency_hz <= high_hz:
            share = math.log(frequency_hz / low_hz) / math.log(high_hz / low_hz)
            return float(low_n * (high_n / low_n) ** share)
    return thresholds_n[-1][1]
