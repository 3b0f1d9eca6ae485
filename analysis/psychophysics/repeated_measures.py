"""Repeated-measures analysis of variance with the corrections of Greenhouse and Geisser and of Huynh and Feldt, and
Friedman's rank test.

Every participant is tested at every frequency (condition), so that differences between participants are removed from
the error term: F = (SS_conditions / (k - 1)) / (SS_error / ((n - 1) (k - 1))) for n participants and k conditions.
Participants with a missing value are left out.

Sources: S. W. Greenhouse, S. Geisser, Psychometrika 24 (1959), 95-112; effect size: S. Olejnik, J. Algina,
Psychol. Methods 8 (2003), 434-447 (generalized eta squared); H. Huynh, L. S. Feldt, J. Educ. Stat. 1 (1976), 69-82;
J. W. Mauchly, Ann. Math. Stat. 11 (1940), 204-209, with the second-order term of T. W. Anderson, An Introduction to
Multivariate Statistical Analysis (2003), section 10.7; M. Friedman, J. Am. Stat. Assoc. 32 (1937), 675-701.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.stats import chi2, friedmanchisquare
from scipy.stats import f as f_distribution

from analysis.psychophysics.anova import is_rounding_error
from equalizer.signals.signal import FloatArray


@dataclass(frozen=True, slots=True)
class FriedmanTest:
    """Result of Friedman's test, which uses only the ranks within each participant and therefore does not depend on the
    scale of the values. Results are None where the test is impossible; `notes` state the reason."""

    participants: int
    """Number of participants without a missing value."""
    chi_squared: float | None
    """Friedman's statistic, corrected for ties."""
    df: int | None
    """Conditions less 1."""
    p: float | None
    """p-value by the chi-squared approximation with `df` degrees of freedom."""
    kendall_w: float | None
    """Kendall's coefficient of concordance, chi_squared / (participants df): 0 no agreement of the rankings, 1 full."""
    notes: tuple[str, ...]


def compute_friedman_test(values: Sequence[Sequence[float | None]]) -> FriedmanTest:
    """Compute Friedman's test of values[subject][condition], rows of equal length; rows with None, NaN or infinity are
    left out. Impossible with fewer than 3 conditions or 2 complete rows, or if each row has equal values."""
    rows = np.array(
        [row for row in values if all(value is not None and math.isfinite(value) for value in row)], dtype=np.float64
    )
    conditions = len(values[0]) if values else 0
    reason = ""
    if conditions < 3:
        reason = f"Friedman's test needs three conditions; there are {conditions}."
    elif len(rows) < 2:
        reason = f"Friedman's test needs two participants who have every condition; there are {len(rows)}."
    elif np.all(rows == rows[:, :1]):
        reason = "Every participant has the same value in all conditions, so there are no ranks to compare."
    if reason:
        return FriedmanTest(len(rows), None, None, None, None, (reason,))
    result = friedmanchisquare(*rows.T)
    df = conditions - 1
    chi_squared = float(result.statistic)
    return FriedmanTest(len(rows), chi_squared, df, float(result.pvalue), chi_squared / (len(rows) * df), ())


@dataclass(frozen=True, slots=True)
class RepeatedMeasures:
    """Result of the analysis of variance. Numbers that the data do not determine are None; `notes` state the
    reasons. Sums of squares (`ss_`) are in the squared unit of the values."""

    participants: int
    """Number of participants without a missing value."""
    left_out: tuple[str, ...]
    """Participants with a missing value."""
    conditions: int
    df_conditions: int | None
    """k - 1."""
    df_error: int | None
    """(n - 1) (k - 1), for n participants."""
    ss_conditions: float | None
    ss_participants: float | None
    ss_error: float | None
    f: float | None
    """F of the conditions."""
    p_uncorrected: float | None
    """Valid only under sphericity: all differences between two conditions have the same variance."""
    epsilon: float | None
    """Epsilon of Greenhouse and Geisser: 1 under sphericity, at least 1 / (conditions - 1)."""
    p: float | None
    """p-value with both degrees of freedom multiplied by epsilon."""
    p_lower_bound: float | None
    """p-value with the smallest possible epsilon, 1 / (conditions - 1)."""
    partial_eta_squared: float | None
    """SS_conditions / (SS_conditions + SS_error)."""
    generalized_eta_squared: float | None
    """SS_conditions / (SS_conditions + SS_participants + SS_error)."""
    notes: tuple[str, ...]
    epsilon_huynh_feldt: float | None = None
    """Huynh and Feldt's epsilon, at most 1. Less conservative than Greenhouse-Geisser's."""
    p_huynh_feldt: float | None = None
    """p-value with both degrees of freedom multiplied by that epsilon."""
    mauchly_w: float | None = None
    """W of Mauchly's test: 1 under sphericity. Also None where `compute_mauchly_test` returns None."""
    mauchly_p: float | None = None
    """p-value of Mauchly's test; small where sphericity is violated."""


def analyse_repeated_measures(
    subjects: Sequence[str], values: Sequence[Sequence[float | None]], rounding: float = 0.0
) -> RepeatedMeasures:
    """Compute the repeated-measures analysis of variance of values[subject][condition], any unit, rows of equal length;
    None, NaN and infinity count as missing. subjects: names, one per row (ValueError otherwise). rounding: rms error,
    in that unit, up to which it counts as rounding, beside that of 64-bit floats. Without 2 complete rows, 2 conditions
    or an error above rounding, all results are None."""
    completeness = [all(value is not None and math.isfinite(value) for value in row) for row in values]
    left_out = tuple(subject for subject, is_complete in zip(subjects, completeness, strict=True) if not is_complete)
    conditions = len(values[0]) if values else 0
    rows = np.array(
        [row for row, is_complete in zip(values, completeness, strict=True) if is_complete], dtype=np.float64
    )
    notes = [f"Left out because a value is missing: {', '.join(left_out)}."] if left_out else []
    if len(rows) < 2:
        notes.append(f"The analysis within participants needs two who have every condition; there are {len(rows)}.")
        return _make_empty_analysis(len(rows), left_out, conditions, notes)
    if conditions < 2:
        notes.append(f"The analysis within participants needs two conditions; there are {conditions}.")
        return _make_empty_analysis(len(rows), left_out, conditions, notes)
    ss_conditions, ss_participants, ss_error = _compute_sums_of_squares(rows)
    if is_rounding_error(ss_error, rows) or ss_error <= rows.size * rounding**2:
        notes.append("All participants change alike over the conditions, so there is no error to compare with.")
        return _make_empty_analysis(len(rows), left_out, conditions, notes)
    return _compute_analysis(rows, left_out, (ss_conditions, ss_participants, ss_error), notes)


def compute_greenhouse_geisser_epsilon(rows: FloatArray) -> float:
    """Compute Greenhouse and Geisser's epsilon, limited to 1 / (k - 1) to 1, from the double-centred covariance of the
    k conditions. rows: (participants, k), both at least 2, with differences that vary between participants."""
    k = int(rows.shape[1])
    covariance = np.cov(rows, rowvar=False)
    centred = covariance - covariance.mean(axis=0) - covariance.mean(axis=1)[:, None] + covariance.mean()
    epsilon = float(np.trace(centred) ** 2 / ((k - 1) * np.sum(centred**2)))
    return min(1.0, max(1.0 / (k - 1), epsilon))


def compute_huynh_feldt_epsilon(epsilon: float, participants: int, conditions: int) -> float:
    """Compute Huynh and Feldt's epsilon from Greenhouse and Geisser's. It may exceed 1; `_compute_analysis` limits
    it."""
    n, df = participants, conditions - 1
    return (n * df * epsilon - 2.0) / (df * (n - 1.0 - df * epsilon))


def compute_mauchly_test(rows: FloatArray) -> tuple[float, float] | None:
    """Compute W and p of Mauchly's test of sphericity. rows: (n participants, k conditions). None for k = 2, n < k, or
    a singular covariance of the contrasts."""
    n, k = rows.shape
    contrast_count = k - 1
    if contrast_count < 2 or n - 1 < contrast_count:
        return None
    # Orthonormal contrasts: an orthonormal basis without the constant vector.
    contrasts = np.linalg.qr(np.column_stack([np.ones(k), np.eye(k)[:, 1:]]))[0][:, 1:]
    eigenvalues = np.linalg.eigvalsh(np.cov(rows @ contrasts, rowvar=False))
    # A singular covariance has a least eigenvalue of 0 but for rounding; the factor is that of `is_rounding_error`.
    if eigenvalues[0] <= 64 * np.finfo(float).eps * eigenvalues[-1]:
        return None
    w_statistic = float(np.exp(np.log(eigenvalues).sum() - contrast_count * np.log(eigenvalues.mean())))
    # Chi-squared approximation with Anderson's second-order term.
    df = contrast_count * (contrast_count + 1) // 2 - 1
    bartlett_factor = (n - 1) - (2 * contrast_count**2 + contrast_count + 2) / (6 * contrast_count)
    chi_squared = -bartlett_factor * math.log(w_statistic)
    second_order_weight = (
        (contrast_count + 2)
        * (contrast_count - 1)
        * (contrast_count - 2)
        * (2 * contrast_count**3 + 6 * contrast_count**2 + 3 * contrast_count + 2)
        / (288 * contrast_count**2 * bartlett_factor**2)
    )
    p_first_order = float(chi2.sf(chi_squared, df))
    return w_statistic, min(
        1.0, p_first_order + second_order_weight * (float(chi2.sf(chi_squared, df + 4)) - p_first_order)
    )


def _compute_sums_of_squares(rows: FloatArray) -> tuple[float, float, float]:
    """Compute the sums of squares of conditions, participants and error. rows: (participants, conditions)."""
    n, k = rows.shape
    by_condition = rows.mean(axis=0) - rows.mean()
    by_participant = rows.mean(axis=1) - rows.mean()
    residual = rows - rows.mean() - by_condition - by_participant[:, None]
    return float(n * np.sum(by_condition**2)), float(k * np.sum(by_participant**2)), float(np.sum(residual**2))


def _compute_analysis(
    rows: FloatArray, left_out: tuple[str, ...], sums_of_squares: tuple[float, float, float], notes: list[str]
) -> RepeatedMeasures:
    """Compute the analysis of complete rows (n, k), n and k at least 2. sums_of_squares: of conditions, participants
    and error (above 0)."""
    (n, k), (ss_conditions, ss_participants, ss_error) = rows.shape, sums_of_squares
    df_conditions, df_error = k - 1, (n - 1) * (k - 1)
    f = (ss_conditions / df_conditions) / (ss_error / df_error)
    epsilon = compute_greenhouse_geisser_epsilon(rows)
    # Where the denominator of Huynh and Feldt's formula is not positive, epsilon is set to 1.
    epsilon_huynh_feldt = (
        min(1.0, compute_huynh_feldt_epsilon(epsilon, n, k)) if n - 1 > df_conditions * epsilon else 1.0
    )
    sphericity = compute_mauchly_test(rows)
    return RepeatedMeasures(
        participants=n,
        left_out=left_out,
        conditions=k,
        df_conditions=df_conditions,
        df_error=df_error,
        ss_conditions=ss_conditions,
        ss_participants=ss_participants,
        ss_error=ss_error,
        f=f,
        p_uncorrected=float(f_distribution.sf(f, df_conditions, df_error)),
        epsilon=epsilon,
        p=float(f_distribution.sf(f, epsilon * df_conditions, epsilon * df_error)),
        p_lower_bound=float(f_distribution.sf(f, 1, n - 1)),
        partial_eta_squared=ss_conditions / (ss_conditions + ss_error),
        generalized_eta_squared=ss_conditions / (ss_conditions + ss_participants + ss_error),
        notes=tuple(notes),
        epsilon_huynh_feldt=epsilon_huynh_feldt,
        p_huynh_feldt=float(f_distribution.sf(f, epsilon_huynh_feldt * df_conditions, epsilon_huynh_feldt * df_error)),
        mauchly_w=sphericity[0] if sphericity else None,
        mauchly_p=sphericity[1] if sphericity else None,
    )


def _make_empty_analysis(
    participants: int, left_out: tuple[str, ...], conditions: int, notes: list[str]
) -> RepeatedMeasures:
    """Make the result of an analysis that is impossible; the last of `notes` states the reason."""
    return RepeatedMeasures(
        participants=participants,
        left_out=left_out,
        conditions=conditions,
        df_conditions=None,
        df_error=None,
        ss_conditions=None,
        ss_participants=None,
        ss_error=None,
        f=None,
        p_uncorrected=None,
        epsilon=None,
        p=None,
        p_lower_bound=None,
        partial_eta_squared=None,
        generalized_eta_squared=None,
        notes=tuple(notes),
    )
