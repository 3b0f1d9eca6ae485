"""Revises the effects that forward selection found: exchanges one for another, or drops one (backward elimination).

Forward selection chooses the first effect while that effect alone must explain the whole error, so that the choice may
be a compromise. The first effect is therefore searched for again with the later effects kept; where another effect fits
better, it replaces the first and becomes the last in the order. This is repeated until no replacement fits better, or
every effect has been tried once (Miller, Subset Selection in Regression, 2002, ch. 3).
"""

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial

import numpy as np

from analysis.diagnosis.errors.hypothesis import Hypothesis, combine, without_claim
from analysis.diagnosis.errors.output_error import evaluate_fit, gather_evidence
from analysis.diagnosis.search.compare_candidates import refine
from analysis.diagnosis.search.explain import Explanation
from analysis.diagnosis.search.next_effect import (
    Step,
    compare_plausible,
    find_first_fits,
    find_next_effect,
)
from analysis.diagnosis.search.parsimony import is_worthwhile, leaves_little, plainest_first, relatives
from analysis.diagnosis.search.search_context import FittedCandidate, SearchContext
from analysis.diagnosis.search.time_budget import OutOfTimeError, limit_map
from analysis.diagnosis.search.verdict import as_good_as_noise, shares_taken, worth_naming
from analysis.diagnosis.settings import EXPLAINED_ERROR, LAST_EFFECT_SHARE
from analysis.diagnosis.types import Progress, TimeBudget
from equalizer.effects.effect import Effect


def without_effect(context: SearchContext, found: Explanation, number: int) -> Explanation:
    """The explanation without one effect; the effects found after it are refitted. number: index of the effect, in the
    order in which they were found. Without the only effect, the explanation is the re-tuned model."""
    if len(found.steps) == 1:
        return replace(found, after=found.retuned, steps=())
    earlier, later = found.steps[:number], list(found.steps[number + 1 :])
    if not later:
        return replace(found, after=context.with_test_score(earlier[-1]), rounds=found.rounds[:number], steps=earlier)
    alone = [_without(context, candidate, number) for candidate in later]
    alone[-1] = context.candidate(refine(context, alone[-1].fitted))
    # Rivals of this stage were fitted without later effects, so they can be compared with a single later one only.
    rivals = found.rounds[number] if len(alone) == 1 else ()
    others = [candidate for candidate in rivals if candidate.newest != alone[0].newest]
    rounds = (*found.rounds[:number], (alone[0], *others), *found.rounds[number + 2 :])
    return replace(found, after=context.with_test_score(alone[-1]), rounds=rounds, steps=(*earlier, *alone))


def without_last_refitted(context: SearchContext, found: Explanation) -> Explanation:
    """The explanation without the last of several effects. The others are refitted from the values that they had with
    it, which may lead to a better minimum than the one before it was added; the better of both minima is used."""
    last, before = len(found.steps) - 1, without_effect(context, found, len(found.steps) - 1)
    freed = context.candidate(refine(context, _without(context, found.steps[-1], last).fitted))
    if not freed.fitted.cost < before.steps[-1].fitted.cost:
        return before
    # Rivals of the remaining last effect were compared at a worse minimum, so they are left out.
    rounds = (*before.rounds[: last - 1], (freed,))
    return replace(before, after=context.with_test_score(freed), rounds=rounds, steps=(*before.steps[:-1], freed))


def _without(context: SearchContext, candidate: FittedCandidate, number: int) -> FittedCandidate:
    """The candidate without its effect of this index, its other values unchanged."""
    fewer: Hypothesis = without_claim(candidate.fitted.hypothesis, number)
    return context.candidate(evaluate_fit(context.measure, context.tuning, candidate.fitted.deviations, fewer))


def drop_needless(context: SearchContext, found: Explanation, time_left: TimeBudget) -> Explanation:
    """Drop the first effect without which the others fit as well: a later effect may have made it superfluous, and the
    last may only have led the others out of a local minimum. Of three effects, also drop the one without which the
    other two leave the smallest error, if that is as small as right laws leave on a real device: no law is exact, and a
    third effect may only fit the remaining error."""
    enough, last = [], len(found.steps) - 1
    for number in range(len(found.steps) if time_left() else 0):
        others = without_effect(context, found, number) if number < last else without_last_refitted(context, found)
        if np.isfinite(others.steps[-1].fitted.cost):
            if not is_worthwhile(others.steps[-1], found.steps[-1]):
                return others if last < 2 else drop_needless(context, others, time_left)
            enough += [others] if last > 1 and context.references is None and as_good_as_noise(others) else []
        if not time_left():
            break
    return min(enough, key=lambda others: others.after.score.mean_log_error, default=found)


def drop_unconfirmed(context: SearchContext, found: Explanation) -> Explanation:
    """Drop a last effect that was added to an explanation whose error was at most `EXPLAINED_ERROR` already, as right
    laws leave on a real device, if the held-out error is not smaller with it."""
    while len(found.steps) > 1 and found.steps[-2].score.worst_channel <= EXPLAINED_ERROR:
        if found.after.held_out < context.with_test_score(found.steps[-2]).held_out or np.isinf(found.after.held_out):
            break
        found = without_effect(context, found, len(found.steps) - 1)
    return found


def drop_negligible(context: SearchContext, found: Explanation) -> Explanation:
    """Drop last effects that remove less than `LAST_EFFECT_SHARE` of the mismatch while the error stays above the noise
    and the others are still worth naming."""
    while len(found.steps) > 1 and not as_good_as_noise(found):
        if shares_taken(found.retuned, found.steps)[-1] >= LAST_EFFECT_SHARE:
            break
        fewer = without_effect(context, found, len(found.steps) - 1)
        if not worth_naming(fewer):
            break
        found = fewer
    return found


def exchange_effects(
    context: SearchContext, found: Explanation, catalogue: Sequence[Effect], progress: Progress, time_left: TimeBudget
) -> Explanation:
    """The explanation with effects exchanged; unchanged where its error is as small as right laws leave on a real
    device, where it has a single effect, where no other effect fits better, or where an exchange crashes."""
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
) -> tuple[Explanation, tuple[FittedCandidate, ...]]:
    """The explanation without its first effect, and the candidates of the whole catalogue in its place."""
    kept = without_effect(context, found, 0)
    return kept, find_next_effect(context, catalogue, kept.steps[-1].fitted, _again(progress))


def exchange_for_relatives(
    context: SearchContext, found: Explanation, catalogue: Sequence[Effect], progress: Progress, time_left: TimeBudget
) -> Explanation:
    """The explanation with its first effect exchanged for another of its family, or a refinement, at the same site:
    which of them fits best may show only when the second effect is known.

    The candidates start from the whole explanation without the first effect, whose other values are not refitted; only
    a candidate with a smaller error than the first effect is fitted further. The first effect is among the candidates,
    so that a refinement must gain as much as in any step.
    """
    tried = relatives(found.steps[0].newest, catalogue) if found.steps else ()
    if len(tried) < 2 or not _may_exchange(context, found, time_left):
        return found
    limited, last = replace(context, map_=limit_map(context.map_, time_left)), found.steps[-1]
    sites = found.steps[0].fitted.hypothesis.claims[-1].sites

    def compare() -> tuple[Explanation, tuple[FittedCandidate, ...]]:
        base = _without(limited, last, 0).fitted
        evidence = gather_evidence(limited.measure, limited.tuning, base)[0]
        fits = find_first_fits(limited, tried, base, evidence, _again(progress), sites)
        better = [law for law in fits if law.cost < last.fitted.cost]
        present = _with_first_at_end(limited, last)
        compared = plainest_first([*compare_plausible(limited, base, better, evidence), present])
        # The other effects are refitted only where the first effect is replaced.
        return found if compared[0] is present else without_effect(limited, found, 0), compared

    return _exchange_first(context, found, compare) or found


def _with_first_at_end(context: SearchContext, candidate: FittedCandidate) -> FittedCandidate:
    """The same fit with its first effect last in the order, so that candidates in its place can be compared with it."""
    whole = first = candidate.fitted.hypothesis
    for number in reversed(range(1, len(whole.claims))):
        first = without_claim(first, number)
    turned = combine(without_claim(whole, 0), first)
    return context.candidate(evaluate_fit(context.measure, context.tuning, candidate.fitted.deviations, turned))


def _may_exchange(context: SearchContext, found: Explanation, time_left: TimeBudget) -> bool:
    """Whether there are two or more effects that may be changed, the error is above `EXPLAINED_ERROR`, and time is
    left."""
    fixed = context.certain or context.references is not None or found.ended_early or found.barred
    more = len(found.steps) > 1 and found.after.score.worst_channel > EXPLAINED_ERROR
    return not fixed and more and time_left()


def _again(progress: Progress) -> Step:
    """The step of the work that the progress display shows for an exchange."""
    return Step("looking again for the first effect", 0.8, progress)


def _exchange_first(
    context: SearchContext, found: Explanation, compare: Callable[[], tuple[Explanation, tuple[FittedCandidate, ...]]]
) -> Explanation | None:
    """The explanation with its first effect replaced by a candidate that fits better with the other effects, which is
    then last in the order; None where there is none. compare: returns the explanation without the first effect, and the
    candidates in its place, the preferred one first."""

    def find() -> tuple[Explanation, tuple[FittedCandidate, ...]] | None:
        try:
            return compare()
        except OutOfTimeError:
            return None

    looked = context.guard.part(found.steps[-1].newest, "its exchange", find, None)
    if looked is None:
        return None
    kept, tried = looked
    named = tuple(candidate for candidate in tried if candidate.newest not in context.barred)
    if not named or named[0] is not tried[0] or not is_worthwhile(found.steps[-1], named[0]):
        return None
    # Rivals of the former first effect are not those of the effect that is first now.
    rounds = (kept.rounds[0][:1], *kept.rounds[1 : len(kept.steps)], named)
    return replace(kept, after=context.with_test_score(named[0]), rounds=rounds, steps=(*kept.steps, named[0]))
