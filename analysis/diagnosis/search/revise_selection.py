"""Revises the effects that forward selection found: exchanges one for another, or drops one (backward elimination).

Forward selection chooses the first effect while that effect alone must explain the whole error, so that the choice may
be a compromise. The first effect is therefore searched for again with the later effects kept; where another effect fits
better, it replaces the first and becomes the last in the order. This is repeated until no replacement fits better, or
every effect has been tried once (Miller, Subset Selection in Regression, 2002, ch. 3). Called by `search`;
`remove_effect` also by `identifiability`, `confirm.require_gain` and `reference.search_with_reference`.
"""

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial

import numpy as np

from analysis.diagnosis.errors.hypothesis import Hypothesis, combine_hypotheses, remove_claim
from analysis.diagnosis.errors.output_error import evaluate_fit, gather_evidence
from analysis.diagnosis.search.compare_candidates import refine
from analysis.diagnosis.search.explain import Explanation
from analysis.diagnosis.search.next_effect import (
    Step,
    compare_plausible_fits,
    find_first_fits,
    find_next_effect,
)
from analysis.diagnosis.search.parsimony import has_small_error, is_worthwhile, list_relatives, move_preferred_first
from analysis.diagnosis.search.search_context import FittedCandidate, SearchContext
from analysis.diagnosis.search.time_budget import OutOfTimeError, limit_map
from analysis.diagnosis.search.verdict import compute_step_shares, is_near_noise, is_worth_naming
from analysis.diagnosis.settings import EXPLAINED_ERROR, LAST_EFFECT_SHARE
from analysis.diagnosis.types import Progress, TimeBudget
from equalizer.effects.effect import Effect


def remove_effect(context: SearchContext, explanation: Explanation, effect_index: int) -> Explanation:
    """Remove one effect from the explanation and refit the effects found after it. effect_index: in the order in which
    they were found. Without its only effect, the explanation is the re-tuned model."""
    if len(explanation.steps) == 1:
        return replace(explanation, after=explanation.retuned, steps=())
    earlier_steps, later_steps = explanation.steps[:effect_index], list(explanation.steps[effect_index + 1 :])
    if not later_steps:
        return replace(
            explanation,
            after=context.with_test_score(earlier_steps[-1]),
            rounds=explanation.rounds[:effect_index],
            steps=earlier_steps,
        )
    refitted_steps = [_omit_effect(context, candidate, effect_index) for candidate in later_steps]
    refitted_steps[-1] = context.score_fit(refine(context, refitted_steps[-1].fitted))
    # Rivals of this stage were fitted without later effects, so they can be compared with a single later one only.
    former_rivals = explanation.rounds[effect_index] if len(refitted_steps) == 1 else ()
    remaining_rivals = [candidate for candidate in former_rivals if candidate.newest != refitted_steps[0].newest]
    rounds = (
        *explanation.rounds[:effect_index],
        (refitted_steps[0], *remaining_rivals),
        *explanation.rounds[effect_index + 2 :],
    )
    return replace(
        explanation,
        after=context.with_test_score(refitted_steps[-1]),
        rounds=rounds,
        steps=(*earlier_steps, *refitted_steps),
    )


def remove_last_refitted(context: SearchContext, explanation: Explanation) -> Explanation:
    """Remove the last of at least two effects. The others are refitted from the values that they had with it, which may
    lead to a smaller minimum of the cost than the one before it was added; the smaller of both is used."""
    last_index, explanation_without_last = (
        len(explanation.steps) - 1,
        remove_effect(context, explanation, len(explanation.steps) - 1),
    )
    refitted_candidate = context.score_fit(
        refine(context, _omit_effect(context, explanation.steps[-1], last_index).fitted)
    )
    if not refitted_candidate.fitted.cost < explanation_without_last.steps[-1].fitted.cost:
        return explanation_without_last
    # Rivals of the remaining last effect were compared at a worse minimum, so they are left out.
    rounds = (*explanation_without_last.rounds[: last_index - 1], (refitted_candidate,))
    return replace(
        explanation_without_last,
        after=context.with_test_score(refitted_candidate),
        rounds=rounds,
        steps=(*explanation_without_last.steps[:-1], refitted_candidate),
    )


def _omit_effect(context: SearchContext, candidate: FittedCandidate, effect_index: int) -> FittedCandidate:
    """Remove the effect of this index from the candidate, its other values unchanged and not refitted."""
    reduced: Hypothesis = remove_claim(candidate.fitted.hypothesis, effect_index)
    return context.score_fit(evaluate_fit(context.measure, context.tuning, candidate.fitted.deviations, reduced))


def drop_unnecessary_effects(context: SearchContext, explanation: Explanation, time_left: TimeBudget) -> Explanation:
    """Drop the first of at least two effects without which the others fit as well; of more than two, repeat. A later
    effect may have made it superfluous, and the last may only have led the others out of a local minimum. Of more than
    two effects without reference recordings, else drop the one without which the others leave the smallest error, if
    that is as small as the noise (`is_near_noise`): no law is exact, and a third effect may only fit the remaining
    error. Unchanged where every effect is needed, or no time is left."""
    sufficient_explanations, last_index = [], len(explanation.steps) - 1
    for effect_index in range(len(explanation.steps) if time_left() else 0):
        reduced = (
            remove_effect(context, explanation, effect_index)
            if effect_index < last_index
            else remove_last_refitted(context, explanation)
        )
        if np.isfinite(reduced.steps[-1].fitted.cost):
            if not is_worthwhile(reduced.steps[-1], explanation.steps[-1]):
                return reduced if last_index < 2 else drop_unnecessary_effects(context, reduced, time_left)
            sufficient_explanations += (
                [reduced] if last_index > 1 and context.references is None and is_near_noise(reduced) else []
            )
        if not time_left():
            break
    return min(sufficient_explanations, key=lambda reduced: reduced.after.score.mean_log_error, default=explanation)


def drop_unconfirmed_effects(context: SearchContext, explanation: Explanation) -> Explanation:
    """Drop a last effect that was added to an explanation whose error was at most `EXPLAINED_ERROR` already, the error
    of correct laws on a real device, if the held-out error is not smaller with it; repeat. The first effect stays, as
    do all where nothing is held out or the simulation diverges."""
    while len(explanation.steps) > 1 and explanation.steps[-2].score.worst_channel <= EXPLAINED_ERROR:
        if explanation.after.held_out_error < context.with_test_score(explanation.steps[-2]).held_out_error or np.isinf(
            explanation.after.held_out_error
        ):
            break
        explanation = remove_effect(context, explanation, len(explanation.steps) - 1)
    return explanation


def drop_negligible_effects(context: SearchContext, explanation: Explanation) -> Explanation:
    """Drop last effects, but not the first, that remove less than `LAST_EFFECT_SHARE` of the mismatch, while the error
    is above the noise and the others are still worth naming."""
    while len(explanation.steps) > 1 and not is_near_noise(explanation):
        if compute_step_shares(explanation.retuned, explanation.steps)[-1] >= LAST_EFFECT_SHARE:
            break
        reduced = remove_effect(context, explanation, len(explanation.steps) - 1)
        if not is_worth_naming(reduced):
            break
        explanation = reduced
    return explanation


def exchange_first_effects(
    context: SearchContext,
    explanation: Explanation,
    catalogue: Sequence[Effect],
    progress: Progress,
    time_left: TimeBudget,
) -> Explanation:
    """Exchange the first effect for one of the catalogue that fits better with the others, at most as often as there
    are effects. Unchanged where the error is small (`has_small_error`), where effects may not be changed
    (`_may_exchange`), where no other effect fits better, or where the comparison crashes."""
    limited_context = replace(context, map_=limit_map(context.map_, time_left))
    for _ in explanation.steps:
        if not _may_exchange(context, explanation, time_left) or has_small_error(
            explanation.retuned, explanation.after
        ):
            break
        exchanged = _exchange_first(
            limited_context,
            explanation,
            partial(_search_first_effect, limited_context, explanation, catalogue, progress),
        )
        if exchanged is None:
            break
        explanation = exchanged
    return explanation


def _search_first_effect(
    context: SearchContext, explanation: Explanation, catalogue: Sequence[Effect], progress: Progress
) -> tuple[Explanation, tuple[FittedCandidate, ...]]:
    """Search the whole catalogue for candidates in place of the first effect. Returns the explanation without that
    effect, and the candidates, the preferred one first."""
    remaining = remove_effect(context, explanation, 0)
    return remaining, find_next_effect(context, catalogue, remaining.steps[-1].fitted, _make_exchange_step(progress))


def exchange_first_for_relatives(
    context: SearchContext,
    explanation: Explanation,
    catalogue: Sequence[Effect],
    progress: Progress,
    time_left: TimeBudget,
) -> Explanation:
    """Exchange the first effect for another of its family, or a refinement, at the same site: which of them fits best
    may show only when the second effect is known.

    The candidates start from the whole explanation without the first effect, whose other values are not refitted; only
    a candidate with a smaller error than the first effect is fitted further. The first effect is among the candidates,
    so that a refinement must gain as much as in any step.
    """
    family = list_relatives(explanation.steps[0].newest, catalogue) if explanation.steps else ()
    if len(family) < 2 or not _may_exchange(context, explanation, time_left):
        return explanation
    limited_context, last_step = replace(context, map_=limit_map(context.map_, time_left)), explanation.steps[-1]
    sites = explanation.steps[0].fitted.hypothesis.claims[-1].sites

    def compare_relatives() -> tuple[Explanation, tuple[FittedCandidate, ...]]:
        base = _omit_effect(limited_context, last_step, 0).fitted
        evidence = gather_evidence(limited_context.measure, limited_context.tuning, base)[0]
        first_fits = find_first_fits(limited_context, family, base, evidence, _make_exchange_step(progress), sites)
        improved_fits = [fitted for fitted in first_fits if fitted.cost < last_step.fitted.cost]
        current_candidate = _move_first_to_end(limited_context, last_step)
        ranked_candidates = move_preferred_first(
            [*compare_plausible_fits(limited_context, base, improved_fits, evidence), current_candidate]
        )
        # The other effects are refitted only where the first effect is replaced.
        return explanation if ranked_candidates[0] is current_candidate else remove_effect(
            limited_context, explanation, 0
        ), ranked_candidates

    return _exchange_first(context, explanation, compare_relatives) or explanation


def _move_first_to_end(context: SearchContext, candidate: FittedCandidate) -> FittedCandidate:
    """Move the first effect of a fit to the end of the order, to compare the fit with candidates in its place."""
    hypothesis = first_effect_alone = candidate.fitted.hypothesis
    for effect_index in reversed(range(1, len(hypothesis.claims))):
        first_effect_alone = remove_claim(first_effect_alone, effect_index)
    reordered = combine_hypotheses(remove_claim(hypothesis, 0), first_effect_alone)
    return context.score_fit(evaluate_fit(context.measure, context.tuning, candidate.fitted.deviations, reordered))


def _may_exchange(context: SearchContext, explanation: Explanation, time_left: TimeBudget) -> bool:
    """Whether there are two or more effects that may be changed, the error is above `EXPLAINED_ERROR`, and time is
    left."""
    is_fixed = context.certain or context.references is not None or explanation.ended_early or explanation.excluded_name
    is_improvable = len(explanation.steps) > 1 and explanation.after.score.worst_channel > EXPLAINED_ERROR
    return not is_fixed and is_improvable and time_left()


def _make_exchange_step(progress: Progress) -> Step:
    """Make the step of the work that the progress display shows for an exchange."""
    return Step("looking again for the first effect", 0.8, progress)


def _exchange_first(
    context: SearchContext,
    explanation: Explanation,
    compare_replacements: Callable[[], tuple[Explanation, tuple[FittedCandidate, ...]]],
) -> Explanation | None:
    """Replace the first effect by a candidate that fits better with the other effects, which is then last in the order;
    None where there is none, where time is out, or where the comparison crashes. compare: returns the explanation
    without the first effect, and the candidates in its place, the preferred one first."""

    def find_exchange() -> tuple[Explanation, tuple[FittedCandidate, ...]] | None:
        try:
            return compare_replacements()
        except OutOfTimeError:
            return None

    comparison = context.guard.run(explanation.steps[-1].newest, "its exchange", find_exchange, None)
    if comparison is None:
        return None
    remaining, ranked_candidates = comparison
    nameable_candidates = tuple(
        candidate for candidate in ranked_candidates if candidate.newest not in context.excluded
    )
    if (
        not nameable_candidates
        or nameable_candidates[0] is not ranked_candidates[0]
        or not is_worthwhile(explanation.steps[-1], nameable_candidates[0])
    ):
        return None
    # Rivals of the former first effect are not those of the effect that is first now.
    rounds = (remaining.rounds[0][:1], *remaining.rounds[1 : len(remaining.steps)], nameable_candidates)
    return replace(
        remaining,
        after=context.with_test_score(nameable_candidates[0]),
        rounds=rounds,
        steps=(*remaining.steps, nameable_candidates[0]),
    )
