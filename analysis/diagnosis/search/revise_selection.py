"""Revise the effects that forward selection found: exchange one for another, or drop one (backward elimination).

Forward selection chooses the first effect while that alone must explain the whole error: it may be a compromise. It is
therefore searched for again with the later effects kept; an effect that fits better replaces it, and becomes the last
in the order. This is repeated until none fits better, or every effect has been tried once (Miller, Subset Selection in
Regression, 2002, ch. 3). A fit near the noise is revised where its re-tuned parameters contradict the calibration: by
an effect that fits as well with far more probable parameters.
"""

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial

import numpy as np

from analysis.diagnosis.errors.hypothesis import Hypothesis, combine_hypotheses, remove_claim
from analysis.diagnosis.errors.output_error import evaluate_fit, gather_evidence
from analysis.diagnosis.limits import EXPLAINED_ERROR, LAST_EFFECT_SHARE
from analysis.diagnosis.search.compare_candidates import refine
from analysis.diagnosis.search.explain import Explanation
from analysis.diagnosis.search.next_effect import (
    Step,
    combine_known_fits,
    compare_plausible_fits,
    find_first_fits,
    find_next_effect,
    select_plausible,
)
from analysis.diagnosis.search.parsimony import (
    has_improbable_deviations,
    has_small_error,
    is_more_probable,
    is_worthwhile,
    list_relatives,
    move_preferred_first,
)
from analysis.diagnosis.search.search_context import FittedCandidate, SearchContext
from analysis.diagnosis.search.time_budget import OutOfTimeError, limit_map
from analysis.diagnosis.search.verdict import compute_step_shares, is_near_noise, is_worth_naming
from analysis.diagnosis.types import Progress, TimeBudget
from equalizer.effects.effect import Effect


def remove_effect(context: SearchContext, explanation: Explanation, effect_index: int) -> Explanation:
    """Remove one effect from the explanation. Where effects were found after it, the others are refitted together in
    the last step; the steps before keep their values. effect_index: in the order in which they were found. After the
    removal of its only effect, the explanation is the re-tuned model."""
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
    """Remove the last of at least two effects. The others keep the fit from before it was added, or are refitted from
    their values in the fit with it, whichever has the smaller cost (the cost may have several minima)."""
    last_index = len(explanation.steps) - 1
    explanation_without_last = remove_effect(context, explanation, last_index)
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
    reduced_hypothesis: Hypothesis = remove_claim(candidate.fitted.hypothesis, effect_index)
    return context.score_fit(
        evaluate_fit(context.measure, context.tuning, candidate.fitted.deviations, reduced_hypothesis)
    )


def drop_unnecessary_effects(context: SearchContext, explanation: Explanation, time_left: TimeBudget) -> Explanation:
    """Drop one of at least two effects by backward elimination: in the order of the search, the first without which the
    others fit as well (not `is_worthwhile`), because later effects replace it; repeated until every effect is needed,
    one remains or no time is left. Where there is none, but three or more effects and no reference recordings: drop the
    one of those tried without which the error is smallest, if that is near the noise (`is_near_noise`), because laws
    are inexact and a third effect may only fit the remaining error. Unchanged where neither is found."""
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
    return min(
        sufficient_explanations,
        key=lambda reduced: reduced.after.score.mean_log_error,
        default=explanation,
    )


def drop_unconfirmed_effects(context: SearchContext, explanation: Explanation) -> Explanation:
    """Drop the last effect if the error before it was added was at most `EXPLAINED_ERROR`, that of correct laws on a
    real device, and the held-out error is not smaller with it; repeated for the effect before. The first effect is
    kept, and all are where the held-out error is infinite (nothing held out, or a diverged simulation)."""
    while len(explanation.steps) > 1 and explanation.steps[-2].score.worst_channel <= EXPLAINED_ERROR:
        if explanation.after.held_out_error < context.with_test_score(explanation.steps[-2]).held_out_error or np.isinf(
            explanation.after.held_out_error
        ):
            break
        explanation = remove_effect(context, explanation, len(explanation.steps) - 1)
    return explanation


def drop_negligible_effects(context: SearchContext, explanation: Explanation) -> Explanation:
    """Drop the last effect while it removes less than `LAST_EFFECT_SHARE` of the mismatch, the error is not near the
    noise, and the others are worth naming (`is_worth_naming`); the first effect is kept."""
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
    are effects. Ends where the error is small (`has_small_error`) with re-tuned parameters that agree with the
    calibration (`has_improbable_deviations`), where effects may not be changed (`_can_exchange`), or where
    `_exchange_first` finds no replacement."""
    limited_context = replace(context, map_=limit_map(context.map_, time_left))
    for _ in explanation.steps:
        is_settled = has_small_error(explanation.retuned, explanation.after) and not has_improbable_deviations(
            explanation.after
        )
        if is_settled or not _can_exchange(context, explanation, time_left):
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
    explanation_without_first = remove_effect(context, explanation, 0)
    return explanation_without_first, find_next_effect(
        context, catalogue, explanation_without_first.steps[-1].fitted, _make_exchange_step(progress)
    )


def exchange_first_for_relatives(
    context: SearchContext,
    explanation: Explanation,
    catalogue: Sequence[Effect],
    progress: Progress,
    time_left: TimeBudget,
) -> Explanation:
    """Exchange the first effect for a related one (`list_relatives`) at the same site, because the fits of related
    effects may differ only once the second effect is in the model.

    The candidates start from the explanation without the first effect, the other values unchanged, or from their fits
    in the first round (`combine_known_fits`); only one with a smaller cost than the explanation is fitted further. The
    first effect is among them, so that a refinement must reduce the error by as much as in any step. Unchanged where
    the error is at most `EXPLAINED_ERROR`, effects may not be changed (`_can_exchange`), the first effect has no
    relatives in the catalogue, or nothing replaces it (`_exchange_first`). Where the time ends, fits count as they are.
    """
    related_effects = list_relatives(explanation.steps[0].newest, catalogue) if explanation.steps else ()
    is_small = explanation.after.score.worst_channel <= EXPLAINED_ERROR
    if len(related_effects) < 2 or is_small or not _can_exchange(context, explanation, time_left):
        return explanation
    limited_context, last_step = replace(context, map_=limit_map(context.map_, time_left)), explanation.steps[-1]
    sites, largest_cost = explanation.steps[0].fitted.hypothesis.claims[-1].sites, last_step.fitted.cost

    def compare_relatives() -> tuple[Explanation, tuple[FittedCandidate, ...]]:
        """Compare the related effects in place of the first: as `compare_replacements` of `_exchange_first`."""
        base = _omit_effect(limited_context, last_step, 0).fitted
        evidence = gather_evidence(limited_context.measure, limited_context.tuning, base)[0]
        fits = combine_known_fits(context, base, explanation.rounds[0][1:], related_effects, sites, largest_cost)
        known_effects = [fitted.hypothesis.claims[-1].effect for fitted in fits]
        others = [effect for effect in related_effects if effect not in known_effects]
        try:
            fits += find_first_fits(limited_context, others, base, evidence, _make_exchange_step(progress), sites)
            fits = sorted((fit for fit in fits if fit.cost < largest_cost), key=lambda fit: fit.cost)
            initial, candidates = explanation, compare_plausible_fits(limited_context, base, fits, evidence)
        except OutOfTimeError:
            initial = replace(explanation, ended_early=True)
            candidates = select_plausible(context, base, [context.score_fit(fitted) for fitted in fits], evidence)
        current_candidate = _move_first_to_end(limited_context, last_step)
        ranked_candidates = move_preferred_first([*candidates, current_candidate])
        is_kept = ranked_candidates[0] is current_candidate
        return initial if is_kept else remove_effect(context, initial, 0), ranked_candidates

    return _exchange_first(context, explanation, compare_relatives) or explanation


def _move_first_to_end(context: SearchContext, candidate: FittedCandidate) -> FittedCandidate:
    """Move the first effect of a fit to the end of the order, to compare the fit with candidates in its place."""
    hypothesis = first_effect_alone = candidate.fitted.hypothesis
    for effect_index in reversed(range(1, len(hypothesis.claims))):
        first_effect_alone = remove_claim(first_effect_alone, effect_index)
    reordered = combine_hypotheses(remove_claim(hypothesis, 0), first_effect_alone)
    return context.score_fit(evaluate_fit(context.measure, context.tuning, candidate.fitted.deviations, reordered))


def _can_exchange(context: SearchContext, explanation: Explanation, time_left: TimeBudget) -> bool:
    """Whether two or more effects were found, none of them is fixed (certain effects, reference recordings, a search
    that ended early, an excluded name), and time is left."""
    is_fixed = context.certain or context.references is not None or explanation.ended_early or explanation.excluded_name
    return not is_fixed and len(explanation.steps) > 1 and time_left()


def _make_exchange_step(progress: Progress) -> Step:
    """Make the step that the progress display shows for an exchange, after a share of 0.8 of the search (chosen)."""
    return Step("looking again for the first effect", 0.8, progress)


def _exchange_first(
    context: SearchContext,
    explanation: Explanation,
    compare_replacements: Callable[[], tuple[Explanation, tuple[FittedCandidate, ...]]],
) -> Explanation | None:
    """Replace the first effect by the preferred candidate, which becomes the last. None without candidates, where that
    one is excluded or neither `is_worthwhile` nor `is_more_probable`, the time is over, or the comparison crashes.
    compare_replacements: returns the explanation without the first effect, and the candidates, the preferred first."""

    def compare_within_time() -> tuple[Explanation, tuple[FittedCandidate, ...]] | None:
        """Compare the replacements; None where the time is over."""
        try:
            return compare_replacements()
        except OutOfTimeError:
            return None

    comparison = context.guard.run(explanation.steps[-1].newest, "its exchange", compare_within_time, None)
    if comparison is None:
        return None
    explanation_without_first, ranked_candidates = comparison
    preferred, last_step = next(iter(ranked_candidates), None), explanation.steps[-1]
    if preferred is None or preferred.newest in context.excluded:
        return None
    if not (is_worthwhile(last_step, preferred) or is_more_probable(last_step, preferred)):
        return None
    # Rivals of the former first effect are not those of the effect that is first now.
    rounds = (
        explanation_without_first.rounds[0][:1],
        *explanation_without_first.rounds[1 : len(explanation_without_first.steps)],
        tuple(candidate for candidate in ranked_candidates if candidate.newest not in context.excluded),
    )
    return replace(
        explanation_without_first,
        after=context.with_test_score(preferred),
        rounds=rounds,
        steps=(*explanation_without_first.steps, preferred),
    )
