"""How likely each contender is the right one, from how far apart they stand."""

from collections.abc import Sequence

import numpy as np

from analysis.diagnosis.search.parsimony import only_refines
from analysis.diagnosis.search.rivalry import Contender

SCALE = 0.002
"""Difference of mean log error power that makes a contender e times less likely."""
LEAST, MOST = 0.01, 0.8
"""Chances that none of them is right: where nothing is left but noise, and where much more is."""
HALFWAY, STEEPNESS = 0.35, 1.5
"""Errors so many times the noise above it are as likely a sign that none is right as that one is; and how fast that
turns. All three are what a bank of simulated devices showed, see docs/proof.md."""


def probabilities(contenders: Sequence[Contender], left: float) -> tuple[float, ...]:
    """One each, in sum less than 1; the first is the one to prefer. What only refines it counts for it. left: errors
    of the whole explanation in the worst channel, in units of the noise."""
    if not contenders:
        return ()
    best = contenders[0]
    behind = np.array([max(one.standing.chosen_by - best.standing.chosen_by, 0.0) for one in contenders])
    refines = np.array([one is not best and only_refines(one, best) for one in contenders])
    weights = np.where(refines, 0.0, np.exp(-behind / SCALE))
    return tuple((1 - elsewhere(left)) * float(one) for one in weights / weights.sum())


def elsewhere(left: float) -> float:
    """The chance that what is named is not what is there, though nothing else in the catalogue does better."""
    odds = (max(left - 1.0, 0.0) / HALFWAY) ** STEEPNESS
    return float(LEAST + (MOST - LEAST) * odds / (1 + odds))
