"""An explanation without one of its effects, whose place the next one takes."""

from dataclasses import replace

from analysis.diagnosis.errors.hypothesis import Hypothesis, without_claim
from analysis.diagnosis.errors.output_error import evaluated
from analysis.diagnosis.search.explain import Explanation
from analysis.diagnosis.search.rivalry import Arena, Contender, refine


def without_step(arena: Arena, found: Explanation, number: int) -> Explanation:
    """number: of the effect, in the order in which they were found; those after it are fitted anew. There must be
    another."""
    earlier, later = found.steps[:number], list(found.steps[number + 1 :])
    if not later:
        return replace(found, after=arena.confirmed(earlier[-1]), rounds=found.rounds[:number], steps=earlier)
    alone = [_without(arena, one, number) for one in later]
    alone[-1] = arena.contender(refine(arena, alone[-1].fitted))
    others = [one for one in found.rounds[number] if _last(one) != _last(alone[0])]
    rounds = (*found.rounds[:number], (alone[0], *others), *found.rounds[number + 2 :])
    return replace(found, after=arena.confirmed(alone[-1]), rounds=rounds, steps=(*earlier, *alone))


def _without(arena: Arena, one: Contender, number: int) -> Contender:
    fewer: Hypothesis = without_claim(one.fitted.hypothesis, number)
    return arena.contender(evaluated(arena.measure, arena.tuning, one.fitted.deviations, fewer))


def _last(one: Contender) -> str:
    return one.fitted.hypothesis.claims[-1].effect.name
