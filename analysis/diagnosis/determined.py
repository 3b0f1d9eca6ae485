"""Whether recordings fix the numbers of what was found, without which it is no more than a way to bend the model."""

from collections.abc import Iterator
from dataclasses import replace

from analysis.diagnosis.explain import Explanation
from analysis.diagnosis.intervals import standard_errors
from analysis.diagnosis.named_effects import named_effects, said_of
from analysis.diagnosis.parsimony import both_stand
from analysis.diagnosis.rivalry import Arena, sensitivity_at
from equalizer.signals.signal import FloatArray

UNDETERMINED = 5.0
"""An interval that reaches so many times as far as the number is from none."""
MOST_TRIED = 2


def number_errors(arena: Arena, found: Explanation) -> FloatArray:
    """(numbers,): standard errors of the final hypothesis's point."""
    if found.statistic is not None:
        return found.statistic.errors
    fitted = found.steps[-1].fitted
    known = sensitivity_at(arena, fitted.deviations, fitted.hypothesis)
    return standard_errors(arena.measure, arena.tuning, fitted, known)[len(fitted.deviations) :]


def determined(arena: Arena, found: Explanation) -> Explanation:
    """As it is, where its numbers are fixed; else what is as good and has them, or nothing."""
    if found.statistic is not None or arena.certain or not found.steps or not any(_open(arena, found)):
        return found
    if len(found.steps) > 1:
        fewer = replace(found, after=arena.confirmed(found.steps[-2]), rounds=found.rounds[:-1], steps=found.steps[:-1])
        return fewer if not any(_open(arena, fewer)) else _nothing(found)
    best, *others = found.rounds[0]
    for other in [one for one in others if both_stand(best, one)][:MOST_TRIED]:
        rest = (best, *(one for one in others if one is not other))
        instead = replace(found, after=arena.confirmed(other), rounds=((other, *rest),), steps=(other,))
        if not any(_open(arena, instead)):
            return instead
    return _nothing(found)


def _nothing(found: Explanation) -> Explanation:
    names = [one.effect.name for one in found.after.fitted.hypothesis.claims]
    return replace(found, after=found.retuned, steps=(), undetermined=tuple(names))


def _open(arena: Arena, found: Explanation) -> Iterator[bool]:
    """By named effect: whether its main number might as well be anything."""
    said = said_of(arena.whole.records[0].recording, arena.tuning.model)
    placed = found.after.fitted.hypothesis.claims
    for claim, named in zip(placed, named_effects(found, number_errors(arena, found), said), strict=True):
        main = claim.effect.parameters[0]
        estimate = named.parameters.get(main.name)
        if estimate is None or estimate.ci95 is None or main.none is None:
            yield False
            continue
        low, high = estimate.ci95
        yield (high - low) / 2 > UNDETERMINED * abs(estimate.value - main.none)
