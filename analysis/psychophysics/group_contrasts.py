"""Contrasts within participants, each frequency against the lowest or a declared pair: difference, equivalence, spread.

Sources: S. Holm, Scand. J. Stat. 6 (1979), 65-70; D. J. Schuirmann, J. Pharmacokinet. Biopharm. 15 (1987), 657-680 (two
one-sided tests); E. J. G. Pitman, Biometrika 31 (1939), 9-12 and W. A. Morgan, Biometrika 31 (1939), 13-19 (equal
spread of paired values).
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
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
    """Holm's, over all contrasts of the family, also those that are not reported: together wrong in at most 5 %."""
    effect_size: float | None
    """Mean over standard deviation of the differences (Cohen's d_z); None where the differences are not known."""
    p_equivalence: float | None
    """Two one-sided tests against +-2 dB; None where equivalence was not asked."""
    p_spread: float | None
    """Pitman and Morgan: whether people differ equally much at both frequencies. None below three participants."""


@dataclass(frozen=True, slots=True, eq=False)
class MeanErrors:
    """Standard errors of means over people, (m,) each."""

    people: NDArray[np.intp]
    """Those with answers of their own."""
    error: FloatArray
    """Infinite below two of them."""
    df: FloatArray
    """Degrees of freedom for Student's t."""


def mean_errors(values: FloatArray, known: NDArray[np.bool_]) -> MeanErrors:
    """Errors of the means of pseudo-values. values: (n, m), one from each person; known: (n, m), whether it rests on
    answers of their own there, or only on their answers at other frequencies.

    Where all are known this is the textbook's error, with n - 1 degrees of freedom. Else both groups of people add
    their part, each with its own degrees of freedom (F. E. Satterthwaite, Biometrics Bull. 2 (1946), 110-114): the
    estimate follows the few who have answers, so that their number counts and not that of all.
    """
    n = len(values)
    people = known.sum(axis=0)
    squares = ((values - values.mean(axis=0)) / n) ** 2
    known_df = np.maximum(people - 1, 1)
    inside = np.sum(squares * known, axis=0) * people / known_df
    outside, others = np.sum(squares * ~known, axis=0), np.maximum(n - people, 1)
    error = np.where(people == n, values.std(axis=0, ddof=1) / math.sqrt(n), np.sqrt(inside + outside))
    # Where all values are equal both parts are 0.
    below = inside**2 / known_df + outside**2 / others
    df = np.where(people == n, n - 1.0, known_df)
    df = np.divide((inside + outside) ** 2, below, out=df, where=(people < n) & (below > 0))
    return MeanErrors(people, np.where(people < 2, math.inf, error), df)


def contrasts(
    frequencies_hz: Sequence[float],
    values_db: FloatArray,
    confidence: float,
    known: NDArray[np.bool_] | None = None,
) -> tuple[Contrast, ...]:
    """values_db: (n, k), NaN for a gap. Contrasts without two participants, or with differences equal in all, are
    left out, but stay in Holm's family: its size is planned, and not chosen by the data. known: (n, k), of
    pseudo-values, which have no gaps; see `mean_errors`."""
    known = np.isfinite(values_db) if known is None else known
    found = []
    for place in range(1, len(frequencies_hz)):
        both = values_db[:, [0, place]]
        whole = np.isfinite(both).all(axis=1)
        both, having = both[whole], np.asarray(known[whole][:, [0, place]].all(axis=1))
        if having.sum() >= 2 and np.ptp(both[:, 1] - both[:, 0]) > ROUNDING_DB:
            found.append((frequencies_hz[place], _Pair(both, having)))
    corrected = holm_correction([pair.p for _, pair in found], len(frequencies_hz) - 1)
    return tuple(
        _compute_contrast(frequency, frequencies_hz[0], pair, p_holm, confidence)
        for (frequency, pair), p_holm in zip(found, corrected, strict=True)
    )


def pair_contrast(
    frequencies_hz: Sequence[float],
    values_db: FloatArray,
    pair_hz: Sequence[float],
    confidence: float,
    known: NDArray[np.bool_] | None = None,
) -> Contrast | None:
    """The first frequency of the pair minus the second. values_db, known: (n, k), as `contrasts` takes them.

    None without a pair, where one of the two was not played, and where `contrasts` leaves it out. A family of its own:
    Holm's p is the plain one.
    """
    if len(pair_hz) != 2 or not set(pair_hz) <= set(frequencies_hz):
        return None
    first, second = (list(frequencies_hz).index(frequency_hz) for frequency_hz in pair_hz)
    places = [second, first]
    having = None if known is None else known[:, places]
    return next(iter(contrasts((pair_hz[1], pair_hz[0]), values_db[:, places], confidence, having)), None)


def holm_correction(p_values: Sequence[float], planned: int | None = None) -> tuple[float, ...]:
    """Holm's step-down correction for multiple tests, in the order given. planned: size of the family, with tests that
    have no p and so come last; None: those given."""
    size = len(p_values) if planned is None else planned
    corrected, worst = [0.0] * len(p_values), 0.0
    for rank, index in enumerate(sorted(range(len(p_values)), key=lambda i: p_values[i])):
        worst = max(worst, min(1.0, (size - rank) * p_values[index]))
        corrected[index] = worst
    return tuple(corrected)


class _Pair:
    """Values (n, 2) at two frequencies, and how well their mean difference is known. having: (n,), as `mean_errors`
    takes it."""

    def __init__(self, both: FloatArray, having: NDArray[np.bool_]) -> None:
        self.both, self.differences = both, both[:, 1] - both[:, 0]
        errors = mean_errors(self.differences[:, None], having[:, None])
        self.people, self.whole = int(errors.people[0]), bool(having.all())
        self.mean, self.error, self.df = float(self.differences.mean()), float(errors.error[0]), float(errors.df[0])
        self.p = float(2.0 * student.sf(abs(self.mean) / self.error, self.df))


def _compute_contrast(
    frequency_hz: float, against_hz: float, pair: _Pair, p_holm: float, confidence: float
) -> Contrast:
    half = float(student.ppf(0.5 + confidence / 2, pair.df)) * pair.error
    equivalence = _equivalence_p(pair.mean, pair.error, pair.df)
    return Contrast(
        frequency_hz=frequency_hz,
        against_hz=against_hz,
        participants=pair.people,
        difference_db=pair.mean,
        lower_db=pair.mean - half,
        upper_db=pair.mean + half,
        p=pair.p,
        p_holm=p_holm,
        effect_size=pair.mean / float(pair.differences.std(ddof=1)) if pair.whole else None,
        p_equivalence=equivalence if max(frequency_hz, against_hz) <= EQUIVALENCE_UP_TO_HZ else None,
        p_spread=float(pearsonr(pair.both.sum(axis=1), pair.differences).pvalue)
        if pair.whole and pair.people > 2
        else None,
    )


def _equivalence_p(mean_db: float, error_db: float, df: float, margin_db: float = EQUIVALENCE_DB) -> float:
    return float(student.sf((margin_db - abs(mean_db)) / error_db, df))
