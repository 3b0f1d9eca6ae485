"""How likely each contender is the right one, from how far apart they stand."""

from collections.abc import Sequence

import numpy as np

from analysis.diagnosis.rivalry import Contender

SCALE = 0.002
"""Difference of mean log error power that makes a contender e times less likely."""
ELSEWHERE = 0.02
"""That none of them is right."""


def probabilities(contenders: Sequence[Contender]) -> tuple[float, ...]:
    """One each; in sum less than 1."""
    errors = np.array([one.standing.chosen_by for one in contenders])
    weights = np.exp(-(errors - errors.min()) / SCALE)
    return tuple((1 - ELSEWHERE) * float(one) for one in weights / weights.sum())
