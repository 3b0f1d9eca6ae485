"""Multiple comparisons: Tukey-Kramer pairs, and the comparison intervals that MATLAB's multcompare draws.

With q the upper quantile of the studentized range for k groups and the degrees of freedom within groups, the
difference of two means has the simultaneous interval (m_j - m_i) ± q sqrt(MS_within / 2 (1 / n_i + 1 / n_j)).

Two groups differ significantly when their comparison intervals are disjoint: exactly for equal sizes (Tukey),
approximately for unequal ones. The intervals are NOT confidence intervals of the means.

Source: Y. Hochberg, A. C. Tamhane, Multiple Comparison Procedures (1987), equation 3.32; C. Y. Kramer,
Biometrics 12 (1956), 307-310.
"""

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.stats import studentized_range

from analysis.psychophysics.anova import GroupSummary, OneWayAnova


@dataclass(frozen=True, slots=True)
class PairDifference:
    """Difference of two group means, its simultaneous confidence interval and p-value (Tukey-Kramer). Means, limits and
    differences have the unit of the compared values."""

    first: str
    second: str
    """Names of the two groups."""
    difference: float
    """Mean of the second group minus mean of the first."""
    lower: float
    upper: float
    """Limits of the simultaneous confidence interval of the difference."""
    p: float
    """Tukey-Kramer p-value, corrected for all pairs."""


@dataclass(frozen=True, slots=True)
class ComparisonInterval:
    """A group's mean and its comparison interval, which is not a confidence interval."""

    name: str
    mean: float
    lower: float
    upper: float
    """Limits of the comparison interval."""


@dataclass(frozen=True, slots=True)
class Comparisons:
    """Multiple comparisons of group means: every pair, and a comparison interval for each group."""

    confidence: float
    """Simultaneous confidence level over all pairs, 0 to 1."""
    critical_range: float | None
    """Quantile of the studentized range; None where nothing can be compared."""
    pairs: tuple[PairDifference, ...]
    """Every pair of groups, in the order of the groups; empty where nothing can be compared."""
    intervals: tuple[ComparisonInterval, ...]
    """One per group; empty where nothing can be compared."""
    notes: tuple[str, ...]
    """Reason, in words, where nothing can be compared."""


def compare_group_means(anova: OneWayAnova, confidence: float = 0.95) -> Comparisons:
    """Compare all pairs of the groups of an ANOVA that have a value, with a comparison interval for each. Where the
    ANOVA has no mean square within groups (no spread, or values in fewer than two groups), the result has no pairs and
    a note. confidence: 0 to 1."""
    if anova.mean_square_within is None or anova.df_within is None:
        return Comparisons(confidence, None, (), (), ("Pairs need values in two groups and a spread within groups.",))
    groups = [group for group in anova.groups if group.n > 0]
    return compute_tukey_kramer(groups, anova.mean_square_within, anova.df_within, confidence)


def compute_tukey_kramer(
    groups: Sequence[GroupSummary], mean_square_within: float, df_within: int, confidence: float = 0.95
) -> Comparisons:
    """Compute Tukey-Kramer intervals and p-values of all pairs. mean_square_within, df_within: mean square (squared
    unit of the values) and degrees of freedom of the ANOVA's error term. Raises ValueError unless there are at least
    two groups, all with a mean."""
    means = [group.mean for group in groups if group.mean is not None]
    if len(means) != len(groups) or len(groups) < 2:
        raise ValueError(f"a comparison needs two or more groups that all have a mean; got {len(means)}")
    group_sizes = [group.n for group in groups]
    critical_range = float(studentized_range.ppf(confidence, len(groups), df_within))
    half_widths = compute_comparison_half_widths(group_sizes, mean_square_within, critical_range)
    pairs = []
    for i, j in itertools.combinations(range(len(groups)), 2):
        difference = means[j] - means[i]
        # Kramer: the difference is divided by the root of the mean of both means' variances.
        standard_error = math.sqrt(mean_square_within / 2 * (1 / group_sizes[i] + 1 / group_sizes[j]))
        p = float(studentized_range.sf(abs(difference) / standard_error, len(groups), df_within))
        pair_half_width = critical_range * standard_error
        # The tail is a numerical integral and may leave [0, 1] by its rounding.
        pairs.append(
            PairDifference(
                first=groups[i].name,
                second=groups[j].name,
                difference=difference,
                lower=difference - pair_half_width,
                upper=difference + pair_half_width,
                p=min(1.0, max(0.0, p)),
            )
        )
    intervals = tuple(
        ComparisonInterval(group.name, mean, mean - half_width, mean + half_width)
        for group, mean, half_width in zip(groups, means, half_widths, strict=True)
    )
    return Comparisons(confidence, critical_range, tuple(pairs), intervals, ())


def compute_comparison_half_widths(
    group_sizes: Sequence[int], mean_square_within: float, critical_range: float
) -> tuple[float, ...]:
    """Compute the half-width (q / sqrt(2)) w_i of the comparison interval of each of k >= 2 groups with the sizes n_i.

    The w_i are least-squares solutions of w_i + w_j = d_ij, the standard deviations of the differences of means:
    w_i = ((k - 1) sum_j d_ij - sum of d over all pairs) / ((k - 1) (k - 2)), and d_12 / 2 for k = 2. For equal sizes n
    and s^2 = mean_square_within, the half-width is q s / (2 sqrt(n)).
    """
    k = len(group_sizes)
    variances = mean_square_within / np.asarray(group_sizes, dtype=np.float64)
    d = np.sqrt(variances[:, None] + variances[None, :])
    np.fill_diagonal(d, 0.0)
    row_sums, pair_sum = d.sum(axis=1), d.sum() / 2
    widths = row_sums / 2 if k == 2 else ((k - 1) * row_sums - pair_sum) / ((k - 1) * (k - 2))
    return tuple(float(width) for width in critical_range / math.sqrt(2) * widths)
