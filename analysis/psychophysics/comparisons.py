"""Multiple comparisons: Tukey-Kramer pairs, and the comparison intervals that MATLAB's multcompare draws.

Two groups differ when their comparison intervals are disjoint: exactly for equal sizes (Tukey), approximately for
unequal ones. The intervals are NOT confidence intervals of the means.

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
    """Difference of two group means, its simultaneous confidence interval and p-value (Tukey-Kramer)."""

    first: str
    second: str
    difference: float
    """Mean of the second group minus mean of the first."""
    lower: float
    upper: float
    p: float


@dataclass(frozen=True, slots=True)
class ComparisonInterval:
    """A group's mean and its comparison interval, which is not a confidence interval."""

    name: str
    mean: float
    lower: float
    upper: float


@dataclass(frozen=True, slots=True)
class Comparisons:
    """Multiple comparisons of group means: every pair, and a comparison interval for each group."""

    confidence: float
    """Simultaneous, over all pairs."""
    critical_range: float | None
    """Quantile of the studentized range."""
    pairs: tuple[PairDifference, ...]
    intervals: tuple[ComparisonInterval, ...]
    notes: tuple[str, ...]


def compare_all(anova: OneWayAnova, confidence: float = 0.95) -> Comparisons:
    """All pairs of the groups of an ANOVA, and one comparison interval per group that has a value."""
    if anova.mean_square_within is None or anova.df_within is None:
        return Comparisons(confidence, None, (), (), ("Without a spread within groups no pairs can be compared.",))
    groups = [group for group in anova.groups if group.n > 0]
    return tukey_kramer(groups, anova.mean_square_within, anova.df_within, confidence)


def tukey_kramer(
    groups: Sequence[GroupSummary], mean_square_within: float, df_within: int, confidence: float = 0.95
) -> Comparisons:
    """Every group must have a mean; two groups at least. mean_square_within, df_within: of the error term."""
    means = [group.mean for group in groups if group.mean is not None]
    if len(means) != len(groups) or len(groups) < 2:
        raise ValueError(f"a comparison needs two or more groups that all have a mean; got {len(means)}")
    sizes = [group.n for group in groups]
    critical = float(studentized_range.ppf(confidence, len(groups), df_within))
    half_widths = comparison_half_widths(sizes, mean_square_within, critical)
    pairs = []
    for i, j in itertools.combinations(range(len(groups)), 2):
        difference = means[j] - means[i]
        # Kramer's form: the range is studentized by the mean of the two variances.
        scale = math.sqrt(mean_square_within / 2 * (1 / sizes[i] + 1 / sizes[j]))
        p = float(studentized_range.sf(abs(difference) / scale, len(groups), df_within))
        margin = critical * scale
        # The tail is a numerical integral and may leave [0, 1] by its rounding.
        pairs.append(
            PairDifference(
                first=groups[i].name,
                second=groups[j].name,
                difference=difference,
                lower=difference - margin,
                upper=difference + margin,
                p=min(1.0, max(0.0, p)),
            )
        )
    intervals = tuple(
        ComparisonInterval(group.name, mean, mean - half, mean + half)
        for group, mean, half in zip(groups, means, half_widths, strict=True)
    )
    return Comparisons(confidence, critical, tuple(pairs), intervals, ())


def comparison_half_widths(sizes: Sequence[int], mean_square_within: float, critical_range: float) -> tuple[float, ...]:
    """Half-width of the comparison interval of each of k >= 2 groups, from their sizes alone.

    Equal sizes n: q s / (2 sqrt(n)). Unequal: the widths w_i whose sums w_i + w_j best stand for the standard
    deviations d_ij of the differences.
    """
    k = len(sizes)
    variances = mean_square_within / np.asarray(sizes, dtype=np.float64)
    d = np.sqrt(variances[:, None] + variances[None, :])
    np.fill_diagonal(d, 0.0)
    each, total = d.sum(axis=1), d.sum() / 2
    widths = each / 2 if k == 2 else ((k - 1) * each - total) / ((k - 1) * (k - 2))
    return tuple(float(width) for width in critical_range / math.sqrt(2) * widths)
