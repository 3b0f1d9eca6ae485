"""Of what a search found, only what is needed: a search that adds one effect at a time keeps what it began with."""

from dataclasses import replace

from analysis.diagnosis.determined import determined
from analysis.diagnosis.explain import Explanation, worthwhile
from analysis.diagnosis.hypothesis import without_claim
from analysis.diagnosis.output_error import evaluated
from analysis.diagnosis.patience import Patience
from analysis.diagnosis.rivalry import Arena, Contender, refine
from analysis.diagnosis.verdict import judge, shares_taken

LITTLE = 0.1
"""Share of the mismatch that a further effect must take where more than noise is left with it, too: no law is exact,
and in what a strong one leaves, any number beside it finds a little."""


def pruned(arena: Arena, found: Explanation, patient: Patience) -> Explanation:
    if found.statistic is None and not arena.certain and len(found.steps) > 1:
        found = _without_little(arena, _without_former(arena, found) if patient() else found)
    return determined(arena, found)


def _without_former(arena: Arena, found: Explanation) -> Explanation:
    """Of two, the later alone where it does as well: the earlier was the best stopgap until the true one had found its
    numbers."""
    if len(found.steps) != 2:
        return found
    both = found.steps[-1]
    later = without_claim(both.fitted.hypothesis, 0)
    start = evaluated(arena.measure, arena.tuning, both.fitted.deviations, later)
    alone = arena.contender(refine(arena, start))
    if worthwhile(alone, both):
        return found
    others = tuple(one for one in found.rounds[0] if one.fitted.hypothesis.key != alone.fitted.hypothesis.key)
    return replace(found, after=arena.confirmed(alone), rounds=((alone, *others),), steps=(alone,))


def _without_little(arena: Arena, found: Explanation) -> Explanation:
    while len(found.steps) > 1 and judge(found).verdict == "partly_explained":
        if shares_taken(found.retuned, found.steps)[-1] >= LITTLE:
            break
        fewer = _without_last(arena, found)
        if not judge(fewer).named:
            break
        found = fewer
    return found


def _without_last(arena: Arena, found: Explanation) -> Explanation:
    steps: tuple[Contender, ...] = found.steps[:-1]
    return replace(found, after=arena.confirmed(steps[-1]), rounds=found.rounds[: len(steps)], steps=steps)
