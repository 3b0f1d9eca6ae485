"""An explanation with one of its effects removed."""

from dataclasses import replace

from analysis.diagnosis.errors.hypothesis import Hypothesis, without_claim
from analysis.diagnosis.errors.output_error import evaluated
from analysis.diagnosis.search.contest import refine
from analysis.diagnosis.search.explain import Explanation
from analysis.diagnosis.search.rivalry import Arena, Contender


def without_step(arena: Arena, found: Explanation, number: int) -> Explanation:
    """number: of the effect, in the order in which they were found; those after it are fitted anew. There must be
    another."""
    earlier, later = found.steps[:number], list(found.steps[number + 1 :])
    if not later:
        return replace(found, after=arena.confirmed(earlier[-1]), rounds=found.rounds[:number], steps=earlier)
    alone = [_without(arena, contender, number) for contender in later]
    alone[-1] = arena.contender(refine(arena, alone[-1].fitted))
    others = [contender for contender in found.rounds[number] if contender.newest != alone[0].newest]
    rounds = (*found.rounds[:number], (alone[0], *others), *found.rounds[number + 2 :])
    return replace(found, after=arena.confirmed(alone[-1]), rounds=rounds, steps=(*earlier, *alone))


def _without(arena: Arena, contender: Contender, number: int) -> Contender:
    fewer: Hypothesis = without_claim(contender.fitted.hypothesis, number)
    return arena.contender(evaluated(arena.measure, arena.tuning, contender.fitted.deviations, fewer))
