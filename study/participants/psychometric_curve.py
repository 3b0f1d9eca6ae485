"""Psychometric function of a two-alternative forced-choice task (Weibull): proportion of correct answers by level."""

import math
from dataclasses import dataclass
from itertools import pairwise
from statistics import NormalDist

TARGET_PROPORTION = 0.5 ** (1 / 3)
"""Proportion correct to which the one-up three-down rule converges, 0.7937 (H. Levitt, J. Acoust. Soc. Am. 49 (1971),
467-477)."""


@dataclass(frozen=True, slots=True)
class WeibullCurve:
    """Psychometric function p(x) = 0.5 + 0.5 F(x) with F(x) = 1 - exp(-(x / a)^slope), x the level (N); the scale a is
    chosen so that p(threshold_n) = TARGET_PROPORTION."""

    threshold_n: float
    """Level (N) with `TARGET_PROPORTION` of correct answers; above 0."""
    slope: float
    """Exponent of the Weibull function, without unit; above 0."""

    def compute_proportion_correct(self, level_n: float) -> float:
        """Compute the proportion of correct answers, 0.5 to 1, at this level (N), at least 0."""
        return 1.0 - 0.5 * math.exp(-_EXPONENT_AT_TARGET * (level_n / self.threshold_n) ** self.slope)

    def compute_d_prime(self, level_n: float) -> float:
        """Compute the sensitivity d' (distance of the two alternatives in standard deviations) with this proportion
        correct p of an unbiased observer: d' = 2 Phi^-1(p), p at most `_LARGEST_PROPORTION`."""
        return 2.0 * NormalDist().inv_cdf(min(self.compute_proportion_correct(level_n), _LARGEST_PROPORTION))


_LARGEST_PROPORTION = 1.0 - 1e-12
"""Largest proportion correct for which d' is computed: the inverse normal distribution is infinite at 1."""

_EXPONENT_AT_TARGET = -math.log(2.0 * (1.0 - TARGET_PROPORTION))
"""Value of (x / a)^slope at the threshold: -ln(2 (1 - TARGET_PROPORTION))."""


def interpolate_threshold_n(thresholds_n: tuple[tuple[float, float], ...], frequency_hz: float) -> float:
    """Interpolate the threshold (N) at a frequency from (Hz, N) pairs, at least one, in ascending order of frequency:
    linear on logarithmic axes, constant beyond the ends."""
    if frequency_hz <= thresholds_n[0][0]:
        return thresholds_n[0][1]
    for (low_hz, low_n), (high_hz, high_n) in pairwise(thresholds_n):
        if frequency_hz <= high_hz:
            fraction = math.log(frequency_hz / low_hz) / math.log(high_hz / low_hz)
            return float(low_n * (high_n / low_n) ** fraction)
    return thresholds_n[-1][1]
