"""Backward elimination: effects that forward selection added and that are not needed are removed."""

import numpy as np

from analysis.diagnosis.search.determined import determined
from analysis.diagnosis.search.explain import Explanation, worthwhile
from analysis.diagnosis.search.rivalry import Arena
from analysis.diagnosis.search.verdict import as_good_as_noise, shares_taken, worth_naming
from analysis.diagnosis.search.without_step import without_step
from analysis.diagnosis.settings import LAST_EFFECT_SHARE
from analysis.diagnosis.types import Patience


def pruned(arena: Arena, found: Explanation, patient: Patience) -> Explanation:
    if found.statistic is not None or arena.certain:
        return found
    if len(found.steps) == 2 and patient():
        found = _without_former(arena, found)
    if arena.sound is None:
        found = _without_little(arena, found)
    return determined(arena, found, patient)


def _without_former(arena: Arena, found: Explanation) -> Explanation:
    """Of two effects, the later alone where it does as well: the earlier may have stood in for it."""
    alone = without_step(arena, found, 0)
    kept = worthwhile(alone.steps[-1], found.steps[-1]) or not np.isfinite(alone.steps[-1].fitted.cost)
    return found if kept else alone


def _without_little(arena: Arena, found: Explanation) -> Explanation:
    while len(found.steps) > 1 and not as_good_as_noise(found):
        if shares_taken(found.retuned, found.steps)[-1] >= LAST_EFFECT_SHARE:
            break
        fewer = without_step(arena, found, len(found.steps) - 1)
        if not worth_naming(fewer):
            break
        found = fewer
    return found
