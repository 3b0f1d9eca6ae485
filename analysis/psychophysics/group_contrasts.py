"""Contrasts within participants, each frequency against the lowest or a declared pair: difference, equivalence, spread.

Sources: S. Holm, Scand. J. Stat. 6 (1979), 65-70; D. J. Schuirmann, J. Pharmacokinet. Biopharm. 15 (1987), 657-680 (two
one-sided tests); E. J. G. Pitman, Biometrika 31 (1939), 9-12 and W. A. Morgan, Biometrika 31 (1939), 13-19 (equal
spread of paired values).
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.stats import pearsonr
from scipy.stats import t as student

from equalizer.signals.signal import FloatArray

EQUIVALENCE_DB = 2.0
"""Differences within this are called equivalent: two of the staircase's small steps, half of its large one."""
EQUIVALENCE_UP_TO_HZ = 25.0
"""Highest frequency (Hz) tested for equivalence: up to it the published thresholds are alike, and none is censored."""

ROUNDING_DB = 1e-9
"""Differences closer than this are equal: sums of the same steps in another order."""


@dataclass(frozen=True, slots=True)
class Contrast:
    """Mean difference in dB between thresholds at two frequencies within participants, with its tests."""

    frequency_hz: float
    against_hz: float
    participants: int
    """Those who have both."""
    difference_db: float
    lower_db: float
    upper_db: float
    p: float
    p_holm: float
    """Holm's, over all contrasts of the family: together wrong in at most 5 %."""
    effect_size: float | None
    """Mean over standard deviation of the differences (Cohen's d_z); None where the differences are not known."""
    p_equivalence: float | None
    """Two one-sided tests against +-2 dB; None where equivalence was not asked."""
    p_spread: float | None
    """Pitman and Morgan: whether people differ equally much at both frequencies. None below three participants."""


def contrasts(frequencies_hz: Sequence[float], values_db: FloatArray, confidence: float) -> tuple[Contrast, ...]:
    """values_db: (n, k), NaN for a gap. Contrasts without two participants, or with differences equal in all, are
    left out."""
    found = []
    for place in range(1, len(frequencies_hz)):
        both = values_db[:, [0, place]]
        both = both[np.isfinite(both).all(axis=1)]
        if len(both) >= 2 and np.ptp(both[:, 1] - both[:, 0]) > ROUNDING_DB:
            found.append((frequencies_hz[place], both))
    p_values = [_t_test(both[:, 1] - both[:, 0]) for _, both in found]
    corrected = holm_correction(p_values)
    return tuple(
        _compute_contrast(frequency, frequencies_hz[0], both, p, p_holm, confidence)
        for (frequency, both), p, p_holm in zip(found, p_values, corrected, strict=True)
    )


def pair_contrast(
    frequencies_hz: Sequence[float], values_db: FloatArray, pair_hz: Sequence[float], confidence: float
) -> Contrast | None:
    """The first frequency of the pair minus the second. values_db: (n, k), NaN for a gap.

    None without a pair, where one of the two was not played, and where `contrasts` leaves it out. A family of its own:
    Holm's p is the plain one.
    """
    if len(pair_hz) != 2 or not set(pair_hz) <= set(frequencies_hz):
        return None
    first, second = (list(frequencies_hz).index(frequency_hz) for frequency_hz in pair_hz)
    return next(iter(contrasts((pair_hz[1], pair_hz[0]), values_db[:, [second, first]], confidence)), None)


def holm_correction(p_values: Sequence[float]) -> tuple[float, ...]:
    """Holm's step-down correction for multiple tests, in the order given."""
    corrected, worst = [0.0] * len(p_values), 0.0
    for rank, index in enumerate(sorted(range(len(p_values)), key=lambda i: p_values[i])):
        worst = max(worst, min(1.0, (len(p_values) - rank) * p_values[index]))
        corrected[index] = worst
    return tuple(corrected)


def _compute_contrast(
    frequency_hz: float, against_hz: float, both: FloatArray, p: float, p_holm: float, confidence: float
) -> Contrast:
    differences, n = both[:, 1] - both[:, 0], len(both)
    mean, sd = float(differences.mean()), float(differences.std(ddof=1))
    half = float(student.ppf(0.5 + confidence / 2, n - 1)) * sd / math.sqrt(n)
    return Contrast(
        frequency_hz=frequency_hz,
        against_hz=against_hz,
        participants=n,
        difference_db=mean,
        lower_db=mean - half,
        upper_db=mean + half,
        p=p,
        p_holm=p_holm,
        effect_size=mean / sd,
        p_equivalence=equivalence_p(differences) if max(frequency_hz, against_hz) <= EQUIVALENCE_UP_TO_HZ else None,
        p_spread=float(pearsonr(both.sum(axis=1), differences).pvalue) if n > 2 else None,
    )


def _t_test(differences: FloatArray) -> float:
    n = len(differences)
    return float(2.0 * student.sf(abs(differences.mean()) / (differences.std(ddof=1) / math.sqrt(n)), n - 1))


def equivalence_p(differences_db: FloatArray, margin_db: float = EQUIVALENCE_DB) -> float:
    """The larger p of two one-sided tests: small where the mean difference is shown to lie within the margin."""
    n = len(differences_db)
    error = differences_db.std(ddof=1) / math.sqrt(n)
    inside = margin_db - abs(differences_db.mean())
    return float(student.sf(inside / error, n - 1))
