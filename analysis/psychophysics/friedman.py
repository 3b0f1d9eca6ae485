"""Friedman's rank test within participants: indifferent to the scale, and to how far a value lies below the cap."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.stats import friedmanchisquare


@dataclass(frozen=True, slots=True)
class Friedman:
    participants: int
    chi_squared: float | None
    df: int | None
    p: float | None
    kendall_w: float | None
    """Agreement of the participants' rankings: 0 none, 1 complete."""
    notes: tuple[str, ...]


def friedman(values: Sequence[Sequence[float | None]]) -> Friedman:
    """values[subject][condition]; rows with None or NaN are left out."""
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
        return Friedman(len(rows), None, None, None, None, (reason,))
    result = friedmanchisquare(*rows.T)
    df = conditions - 1
    chi_squared = float(result.statistic)
    return Friedman(len(rows), chi_squared, df, float(result.pvalue), chi_squared / (len(rows) * df), ())
