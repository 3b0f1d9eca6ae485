"""Revises what forward selection found: an effect is removed, or exchanged.

Forward selection chooses the first effect for what all of them do together, so that it may be a compromise. With the
second effect held, the first is looked for again; where another one fits better, it takes the first one's place, and
the second is looked for again beside it, as often as there are effects (Miller, Subset Selection in Regression, 2002,
ch. 3).
"""

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial

from analysis.diagnosis.errors.hypothesis import Hypothesis, without_claim
from analysis.diagnosis.errors.output_error import evaluate_fit, gather_evidence
from analysis.diagnosis.search.compare_candidates import refine
from analysis.diagnosis.search.explain import Explanation
from analysis.diagnosis.search.next_effect import (
    Step,
    compare_plausible,
    find_first_fits,
    find_next_effect,
)
from analysis.diagnosis.search.parsimony import is_worthwhile, leaves_little, relatives
from analysis.diagnosis.search.search_context import FittedCandidate, SearchContext
from analysis.diagnosis.search.time_budget import OutOfTimeError, limit_map
from analysis.diagnosis.settings import SEARCH_ON
from analysis.diagnosis.types import Progress, TimeBudget
from equalizer.effects.effect import Effect


def without_effect(context: SearchContext, found: Explanation, number: int) -> Explanation:
    """The explanation without one effect; the others are refitted from where they are beside it, which for the last may
    be a better minimum than they had before. number: of the effect, in the order in which they were found; without the
    only one, the re-tuned model is left."""
    if len(found.steps) == 1:
        return replace(found, after=found.retuned, steps=())
    earlier, later = found.steps[:number], list(found.steps[number + 1 :])
    if not later:
        return _without_last(context, found)
    alone = [_without(context, candidate, number) for candidate in later]
    alone[-1] = context.candidate(refine(context, alone[-1].fitted))
    # Beside effects that follow, rivals of this one were not compared.
    rivals = found.rounds[number] if len(alone) == 1 else ()
    others = [candidate for candidate in rivals if candidate.newest != alone[0].newest]
    rounds = (*found.rounds[:number], (alone[0], *others), *found.rounds[number + 2 :])
    return replace(found, after=context.with_test_score(alone[-1]), rounds=rounds, steps=(*earlier, *alone))


def _without_last(context: SearchContext, found: Explanation) -> Explanation:
    """The explanation as it was before its last effect, or refitted from where that has led."""
    before, last = found.steps[-2], len(found.steps) - 1
    freed = context.candidate(refine(context, _without(context, found.steps[-1], last).fitted))
    kept = freed if freed.fitted.cost < before.fitted.cost else before
    rounds = (*found.rounds[: last - 1], (kept, *found.rounds[last - 1][1:]))
    return replace(found, after=context.with_test_score(kept), rounds=rounds, steps=(*found.steps[: last - 1], kept))


def _without(context: SearchContext, candidate: FittedCandidate, number: int) -> FittedCandidate:
    fewer: Hypothesis = without_claim(candidate.fitted.hypothesis, number)
    return context.candidate(evaluate_fit(context.measure, context.tuning, candidate.fitted.deviations, fewer))


def exchange_effects(
    context: SearchContext, found: Explanation, catalogue: Sequence[Effect], progress: Progress, time_left: TimeBudget
) -> Explanation:
    """The explanation with effects exchanged; unchanged where it leaves as little as laws of a real device do, has a
    single effect, nothing fits better, or a law crashes."""
    limited = replace(context, map_=limit_map(context.map_, time_left))
    for _ in found.steps:
        if not _may_exchange(context, found, time_left) or leaves_little(found.retuned, found.after):
            break
        better = _exchange_first(limited, found, partial(_find_first_again, limited, found, catalogue, progress))
        if better is None:
            break
        found = better
    return found


def _find_first_again(
    context: SearchContext, found: Explanation, catalogue: Sequence[Effect], progress: Progress
) -> tuple[FittedCandidate, ...]:
    kept = without_effect(context, found, 0)
    return find_next_effect(context, catalogue, kept.steps[-1].fitted, _again(progress))


def exchange_for_relatives(
    context: SearchContext, found: Explanation, catalogue: Sequence[Effect], progress: Progress, time_left: TimeBudget
) -> Explanation:
    """The explanation with its first effect exchanged for one of its family, or a refinement, at the same place: which
    of them it is may be seen only beside the second effect. They start from the whole explanation without the first
    effect, not fitted anew, and only what then leaves less than the first effect does is fitted on."""
    tried = relatives(found.steps[0].newest, catalogue) if found.steps else ()
    if len(tried) < 2 or not _may_exchange(context, found, time_left):
        return found
    limited, last = replace(context, map_=limit_map(context.map_, time_left)), found.steps[-1]
    sites = found.steps[0].fitted.hypothesis.claims[-1].sites

    def compare() -> tuple[FittedCandidate, ...]:
        base = _without(limited, last, 0).fitted
        evidence = gather_evidence(limited.measure, limited.tuning, base)[0]
        fits = find_first_fits(limited, tried, base, evidence, _again(progress), sites)
        return compare_plausible(limited, base, [law for law in fits if law.cost < last.fitted.cost], evidence)

    return _exchange_first(context, found, compare) or found


def _may_exchange(context: SearchContext, found: Explanation, time_left: TimeBudget) -> bool:
    """Whether there are two effects that are not fixed and leave more than noise, and time."""
    fixed = context.certain or context.references is not None or found.ended_early or found.barred
    more = len(found.steps) > 1 and found.after.score.worst_channel > SEARCH_ON
    return not fixed and more and time_left()


def _again(progress: Progress) -> Step:
    return Step("looking again for the first effect", 0.8, progress)


def _exchange_first(
    context: SearchContext, found: Explanation, compare: Callable[[], tuple[FittedCandidate, ...]]
) -> Explanation | None:
    """The explanation with its first effect replaced by what fits better beside the others; None where nothing does.
    compare: the candidates in its place, the preferred one first."""

    def find() -> Explanation | None:
        try:
            tried = compare()
            named = tuple(candidate for candidate in tried if candidate.newest not in context.barred)
            if not named or named[0] is not tried[0] or not is_worthwhile(found.steps[-1], named[0]):
                return None
            kept = without_effect(context, found, 0)
        except OutOfTimeError:
            return None
        # What was compared with the former first effect are no rivals of the one that is first now.
        rounds = (kept.rounds[0][:1], *kept.rounds[1 : len(kept.steps)], named)
        return replace(kept, after=context.with_test_score(named[0]), rounds=rounds, steps=(*kept.steps, named[0]))

    return context.guard.part(found.steps[-1].newest, "its exchange", find, None)
