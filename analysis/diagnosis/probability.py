"""How likely each contender is the right one, from how far apart they stand."""

from collections.abc import Sequence

import numpy as np

from analysis.diagnosis.parsimony import only_refines
from analysis.diagnosis.rivalry import Contender

SCALE = 0.002
"""Difference of mean log error power that makes a contender e times less likely."""
ELSEWHERE = 0.02
"""That none of them is right."""


def probabilities(contenders: Sequence[Contender]) -> tuple[float, ...]:
    """One each, in sum less than 1; the first is the one to prefer. What only refines it counts for it."""
    if not contenders:
        return ()
    best = contenders[0]
    behind = np.array([max(one.standing.chosen_by - best.standing.chosen_by, 0.0) for one in contenders])
    refines = np.array([one is not best and only_refines(one, best) for one in contenders])
    weights = np.where(refines, 0.0, np.exp(-behind / SCALE))
    return tuple((1 - ELSEWHERE) * float(one) for one in weights / weights.sum())
