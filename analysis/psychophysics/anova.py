"""One-way analysis of variance between groups, the test of the published direction-threshold study.

All values are taken as independent. Where the same participants contribute to all groups (here: every participant is
tested at every frequency), the differences between participants stay in the error term, which lowers the power;
`analysis.psychophysics.repeated_measures` removes them. With k groups and N values,

    F = (SS_between / (k - 1)) / (SS_within / (N - k))          eta² = SS_between / SS_total
    omega² = (SS_between - (k - 1) MS_within) / (SS_total + MS_within)

References: Fisher, Statistical Methods for Research Workers (1925); Hays, Statistics (1963), for omega².
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.stats import f as f_distribution

from equalizer.signals.signal import FloatArray


@dataclass(frozen=True, slots=True)
class GroupSummary:
    """Number, mean and standard deviation of a group's values."""

    name: str
    """Name of the group, such as its frequency."""
    n: int
    mean: float | None
    """None without values."""
    sd: float | None
    """Sample standard deviation; None below two values."""


@dataclass(frozen=True, slots=True)
class OneWayAnova:
    """Result of a one-way ANOVA by the equations of the module. Values that the data do not determine are None; `notes`
    state the reasons. Sums of squares (`ss_`) and the mean square are in the squared unit of the values."""

    groups: tuple[GroupSummary, ...]
    df_between: int | None
    df_within: int | None
    ss_between: float | None
    ss_within: float | None
    mean_square_within: float | None
    f: float | None
    p: float | None
    eta_squared: float | None
    omega_squared: float | None
    """Less biased than eta squared; 0 where the estimate would be negative."""
    notes: tuple[str, ...]


def compute_one_way_anova(groups: Mapping[str, Sequence[float | None]]) -> OneWayAnova:
    """Compute a one-way ANOVA over named groups of values, all in one unit. None, NaN and infinite values are left out
    as missing; groups may differ in size. What the data do not determine is None, with the reason in `notes`, also
    where there are no values at all."""
    samples = {name: _select_finite_values(values) for name, values in groups.items()}
    summaries = tuple(_summarise_group(name, sample) for name, sample in samples.items())
    gap_count = sum(len(values) for values in groups.values()) - sum(len(sample) for sample in samples.values())
    notes = [f"{gap_count} missing value{'s' if gap_count != 1 else ''} left out."] if gap_count else []
    notes += [f"There is no value at {group.name}." for group in summaries if group.n == 0]
    nonempty_groups = [sample for sample in samples.values() if len(sample)]
    if len(nonempty_groups) < 2:
        notes.append(f"A comparison needs values in at least two groups; there are {len(nonempty_groups)}.")
        return _make_undetermined_anova(summaries, notes)
    df_between, df_within = len(nonempty_groups) - 1, sum(map(len, nonempty_groups)) - len(nonempty_groups)
    if df_within < 1:
        notes.append("Every group holds a single value, so there is no spread within groups to compare with.")
        return _make_undetermined_anova(summaries, notes, df_between, df_within)
    return _compute_anova(nonempty_groups, summaries, notes)


def _compute_anova(
    nonempty_groups: list[FloatArray], summaries: tuple[GroupSummary, ...], notes: list[str]
) -> OneWayAnova:
    """Evaluate the equations of the module; no F and p where all values within each group are equal. nonempty_groups:
    at least two arrays (n,), n >= 1, with more values in total than groups."""
    all_values = np.concatenate(nonempty_groups)
    grand_mean = all_values.mean()
    ss_between = float(sum(len(sample) * (sample.mean() - grand_mean) ** 2 for sample in nonempty_groups))
    ss_within = float(sum(((sample - sample.mean()) ** 2).sum() for sample in nonempty_groups))
    df_between, df_within = len(nonempty_groups) - 1, len(all_values) - len(nonempty_groups)
    if is_rounding_error(ss_within, all_values):
        notes.append("All values within each group are equal, so there is no spread to compare with: no F, no p.")
        return _make_undetermined_anova(summaries, notes, df_between, df_within)
    mean_square_within = ss_within / df_within
    ss_total = ss_between + ss_within
    f = ss_between / df_between / mean_square_within
    return OneWayAnova(
        groups=summaries,
        df_between=df_between,
        df_within=df_within,
        ss_between=ss_between,
        ss_within=ss_within,
        mean_square_within=mean_square_within,
        f=f,
        p=float(f_distribution.sf(f, df_between, df_within)),
        eta_squared=ss_between / ss_total,
        omega_squared=max(0.0, (ss_between - df_between * mean_square_within) / (ss_total + mean_square_within)),
        notes=tuple(notes),
    )


def is_rounding_error(sum_of_squares: float, values: FloatArray) -> bool:
    """Whether a sum of squared differences of values (n,), n >= 1, is within their rounding error: at most
    n (64 eps max |value|)², with eps the relative spacing of 64-bit floats; the factor 64 is chosen."""
    largest_magnitude = float(np.abs(values).max())
    return bool(sum_of_squares <= values.size * (64 * np.finfo(float).eps * largest_magnitude) ** 2)


def _select_finite_values(values: Sequence[float | None]) -> FloatArray:
    """Select the values (n,) that are neither None, NaN nor infinite."""
    return np.array([value for value in values if value is not None and math.isfinite(value)], dtype=np.float64)


def _summarise_group(name: str, sample: FloatArray) -> GroupSummary:
    """Summarise a group's values (n,)."""
    return GroupSummary(
        name=name,
        n=len(sample),
        mean=float(sample.mean()) if len(sample) else None,
        sd=float(sample.std(ddof=1)) if len(sample) > 1 else None,
    )


def _make_undetermined_anova(
    groups: tuple[GroupSummary, ...], notes: list[str], df_between: int | None = None, df_within: int | None = None
) -> OneWayAnova:
    """Make a result without sums of squares, F and p; without degrees of freedom where they are None."""
    return OneWayAnova(groups, df_between, df_within, None, None, None, None, None, None, None, tuple(notes))
