"""Contrasts of thresholds within participants: each frequency against the first, or a declared pair of frequencies.

Per contrast: mean difference in dB with its t interval and test (p corrected by Holm's method), two one-sided tests of
equivalence, and the test of Pitman and Morgan of equal variances: the correlation of sum and difference of the paired
values is 0 where both have the same variance. Values are thresholds, or pseudo-thresholds of the hierarchical model.

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
"""Margin of equivalence (dB). Chosen: two small steps of the published staircase, or half a large step."""
EQUIVALENCE_UP_TO_HZ = 25.0
"""Highest frequency (Hz) tested for equivalence: up to it the published thresholds are similar, and none is
censored."""

ROUNDING_DB = 1e-5
"""Range of differences or sums (dB) up to which they count as equal: sums of the same steps differ by rounding, and
pseudo-thresholds of the same answers by the tolerance of the fit (up to 3e-8 dB of simulated people). Chosen."""


@dataclass(frozen=True, slots=True)
class Contrast:
    """Mean difference in dB between thresholds at two frequencies within participants, with its tests."""

    frequency_hz: float
    against_hz: float
    """Frequency whose threshold is subtracted."""
    participants: int
    """Number of participants with answers at both frequencies."""
    difference_db: float
    """Mean over the participants, including those whose values rest on answers at other frequencies."""
    lower_db: float
    upper_db: float
    """Limits of the t interval, uncorrected."""
    p: float
    """Two-sided p value of the t test, uncorrected."""
    p_holm: float
    """p with Holm's correction over all planned contrasts, including those that are not reported."""
    effect_size: float | None
    """Mean over standard deviation of the differences (Cohen's d_z); None where some of them rest on answers at other
    frequencies only."""
    p_equivalence: float | None
    """p value of two one-sided tests against +-`EQUIVALENCE_DB`; None if either is above `EQUIVALENCE_UP_TO_HZ`."""
    p_spread: float | None
    """p value of Pitman and Morgan's test: equal variance between people at both frequencies. None below three
    participants, where the sums of all participants are equal, and where `effect_size` is None."""


@dataclass(frozen=True, slots=True, eq=False)
class MeanErrors:
    """Standard errors of the means of m columns of values over people; arrays are (m,)."""

    people: NDArray[np.intp]
    """Number of people with answers of their own, per column."""
    error: FloatArray
    """Standard error, in the unit of the values; infinite below two such people."""
    df: FloatArray
    """Degrees of freedom for Student's t."""


def compute_mean_errors(pseudo_values: FloatArray, has_answers: NDArray[np.bool_]) -> MeanErrors:
    """Compute standard errors of the means of pseudo-values (n, m), a row per person. has_answers: (n, m), True where
    the value rests on answers of the person there, False where it rests only on answers at other frequencies.

    Where all have answers this is s / sqrt(n) with n - 1 degrees of freedom. Otherwise the variances of both groups
    add, with the degrees of freedom of F. E. Satterthwaite, Biometrics Bull. 2 (1946), 110-114: the estimate depends
    mostly on the few people with answers, so that their number counts, not that of all.
    """
    person_count = len(pseudo_values)
    answered_count = has_answers.sum(axis=0)
    squared_deviations = ((pseudo_values - pseudo_values.mean(axis=0)) / person_count) ** 2
    answered_df = np.maximum(answered_count - 1, 1)
    answered_variance = np.sum(squared_deviations * has_answers, axis=0) * answered_count / answered_df
    unanswered_variance, unanswered_df = (
        np.sum(squared_deviations * ~has_answers, axis=0),
        np.maximum(person_count - answered_count, 1),
    )
    error = np.where(
        answered_count == person_count,
        pseudo_values.std(axis=0, ddof=1) / math.sqrt(person_count),
        np.sqrt(answered_variance + unanswered_variance),
    )
    # Where all values are equal both variances are 0, and df stays that of the people with answers.
    df_denominator = answered_variance**2 / answered_df + unanswered_variance**2 / unanswered_df
    df = np.where(answered_count == person_count, person_count - 1.0, answered_df)
    df = np.divide(
        (answered_variance + unanswered_variance) ** 2,
        df_denominator,
        out=df,
        where=(answered_count < person_count) & (df_denominator > 0),
    )
    return MeanErrors(answered_count, np.where(answered_count < 2, math.inf, error), df)


def compute_contrasts(
    frequencies_hz: Sequence[float],
    values_db: FloatArray,
    confidence: float,
    has_answers: NDArray[np.bool_] | None = None,
) -> tuple[Contrast, ...]:
    """Compute the contrasts of each frequency against the first. values_db: (n, k), NaN for a gap. confidence: of the
    intervals, 0 to 1. Contrasts with answers of fewer than two participants, or with the same difference in all, are
    left out, but count in Holm's family: its size is planned, not chosen by the data. has_answers: (n, k), for
    pseudo-values, which have no gaps (`compute_mean_errors`); by default True where there is a value."""
    has_answers = np.isfinite(values_db) if has_answers is None else has_answers
    pairs = []
    for column in range(1, len(frequencies_hz)):
        paired_db = values_db[:, [0, column]]
        is_complete = np.isfinite(paired_db).all(axis=1)
        paired_db, answered_both = (
            paired_db[is_complete],
            np.asarray(has_answers[is_complete][:, [0, column]].all(axis=1)),
        )
        if answered_both.sum() >= 2 and np.ptp(paired_db[:, 1] - paired_db[:, 0]) > ROUNDING_DB:
            pairs.append((frequencies_hz[column], _PairedDifferences(paired_db, answered_both)))
    corrected_p_values = apply_holm_correction([pair.p for _, pair in pairs], len(frequencies_hz) - 1)
    return tuple(
        _compute_contrast(frequency_hz, frequencies_hz[0], pair, p_holm, confidence)
        for (frequency_hz, pair), p_holm in zip(pairs, corrected_p_values, strict=True)
    )


def compute_pair_contrast(
    frequencies_hz: Sequence[float],
    values_db: FloatArray,
    pair_hz: Sequence[float],
    confidence: float,
    has_answers: NDArray[np.bool_] | None = None,
) -> Contrast | None:
    """Compute the contrast of the first frequency of the pair minus the second. values_db, has_answers: (n, k), as for
    `compute_contrasts`.

    None without a pair, where one of the two was not played, and where `compute_contrasts` leaves it out. The family
    has one test, so that `p_holm` equals `p`."""
    if len(pair_hz) != 2 or not set(pair_hz) <= set(frequencies_hz):
        return None
    first_column, second_column = (list(frequencies_hz).index(frequency_hz) for frequency_hz in pair_hz)
    columns = [second_column, first_column]
    pair_has_answers = None if has_answers is None else has_answers[:, columns]
    return next(
        iter(compute_contrasts((pair_hz[1], pair_hz[0]), values_db[:, columns], confidence, pair_has_answers)), None
    )


def apply_holm_correction(p_values: Sequence[float], planned: int | None = None) -> tuple[float, ...]:
    """Correct p values by Holm's step-down method; in the order given. planned: size of the family, including tests
    without a p value, which rank last; None: the number of p values."""
    family_size = len(p_values) if planned is None else planned
    corrected_p_values, largest_p = [0.0] * len(p_values), 0.0
    for rank, original_index in enumerate(sorted(range(len(p_values)), key=lambda test_index: p_values[test_index])):
        largest_p = max(largest_p, min(1.0, (family_size - rank) * p_values[original_index]))
        corrected_p_values[original_index] = largest_p
    return tuple(corrected_p_values)


class _PairedDifferences:
    """Values (n, 2) in dB at two frequencies, with mean, standard error, degrees of freedom and p value of their
    differences, second minus first. answered_both: (n,), `has_answers` of `compute_mean_errors`."""

    def __init__(self, paired_db: FloatArray, answered_both: NDArray[np.bool_]) -> None:
        """Compute the differences and their statistics; at least two participants must have answered at both."""
        self.paired_db, self.differences_db = paired_db, paired_db[:, 1] - paired_db[:, 0]
        errors = compute_mean_errors(self.differences_db[:, None], answered_both[:, None])
        self.people, self.all_answered = int(errors.people[0]), bool(answered_both.all())
        self.mean_db, self.error_db, self.df = (
            float(self.differences_db.mean()),
            float(errors.error[0]),
            float(errors.df[0]),
        )
        self.p = float(2.0 * student.sf(abs(self.mean_db) / self.error_db, self.df))


def _compute_contrast(
    frequency_hz: float, against_hz: float, pair: _PairedDifferences, p_holm: float, confidence: float
) -> Contrast:
    """Compute the contrast of a pair, with its interval at this confidence and its further tests."""
    half_width_db = float(student.ppf(0.5 + confidence / 2, pair.df)) * pair.error_db
    p_equivalence = _compute_equivalence_p(pair.mean_db, pair.error_db, pair.df)
    sums_db = pair.paired_db.sum(axis=1)
    return Contrast(
        frequency_hz=frequency_hz,
        against_hz=against_hz,
        participants=pair.people,
        difference_db=pair.mean_db,
        lower_db=pair.mean_db - half_width_db,
        upper_db=pair.mean_db + half_width_db,
        p=pair.p,
        p_holm=p_holm,
        effect_size=pair.mean_db / float(pair.differences_db.std(ddof=1)) if pair.all_answered else None,
        p_equivalence=p_equivalence if max(frequency_hz, against_hz) <= EQUIVALENCE_UP_TO_HZ else None,
        p_spread=float(pearsonr(sums_db, pair.differences_db).pvalue)
        if pair.all_answered and pair.people > 2 and np.ptp(sums_db) > ROUNDING_DB
        else None,
    )


def _compute_equivalence_p(mean_db: float, error_db: float, df: float, margin_db: float = EQUIVALENCE_DB) -> float:
    """Compute the p value of Schuirmann's two one-sided t tests against +-margin_db: the larger of the two."""
    return float(student.sf((margin_db - abs(mean_db)) / error_db, df))
