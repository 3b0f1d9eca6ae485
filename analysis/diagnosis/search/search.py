"""Search for missing effects with a given model: forward selection, backward elimination, verdict.

1. Forward selection (`add_effects`) uses the samples to fit and to choose by. After a second effect, the first may be
   exchanged for another of its family, then, as after a third, for any that fits better (`revise_selection`).
2. Backward elimination (`prune`) removes effects without which the others, refitted, fit as well; those that remove
   too little of the mismatch, or none of the held-out error where it was small; and those that the data do not
   determine (`identifiability`: no interval, or profile likelihood of an only amplitude, excludes the null value).
3. `verdict.judge` compares the errors, in units of the noise, with limits. The errors on held-out samples, to which
   nothing was fitted, can there only withdraw names or the verdict "explained".
4. Where only the held-out samples show a mismatch (such as an end stop that only the loudest segment reaches), a part
   of them is opened, that is, used to fit and to choose by, and the search repeated: all but the loudest segments; else
   the first half of each stretch, or every other of more parts. The part still held out must confirm what this finds.
5. Where the catalogue leaves a mismatch, `FurtherSearches` look beyond it: before a second effect for rattling play
   (`impacts`), if no single effect is worth adding, then for a law outside the catalogue (`discovery`), a shorter
   description than two effects; before a third effect for play, then laws; at last laws (`_choose_early_or_full`).
6. Where a mismatch remains, or three effects are needed, and a parameter of the model is at its bound, the search is
   repeated with a wider bound (`repeat_with_wider_bound`): a model that was fitted to this device may have absorbed
   missing physics. The new result is used if it explains what the first does not, or with fewer effects.

Reference: Hastie, Tibshirani and Friedman, The Elements of Statistical Learning (2009), 7.2, 3.3 (stepwise selection).
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

from analysis.diagnosis.errors.output_error import evaluate_fit
from analysis.diagnosis.limits import EXPLAINED_ERROR
from analysis.diagnosis.search.compare_candidates import refine
from analysis.diagnosis.search.explain import Explanation, add_effects, explain, is_worth_searching, start_explanation
from analysis.diagnosis.search.identifiability import keep_identifiable
from analysis.diagnosis.search.no_prediction import has_no_predictive_power
from analysis.diagnosis.search.parsimony import has_far_smaller_error, has_small_error
from analysis.diagnosis.search.revise_selection import (
    drop_negligible_effects,
    drop_unconfirmed_effects,
    drop_unnecessary_effects,
    exchange_first_effects,
    exchange_first_for_relatives,
)
from analysis.diagnosis.search.search_context import (
    FINER_PARTS,
    HALVES,
    FittedCandidate,
    SearchContext,
    has_held_out_mismatch,
)
from analysis.diagnosis.search.time_budget import OUT_OF_TIME, OutOfTimeError, grant_time
from analysis.diagnosis.search.verdict import (
    MILDER_TEST_USED,
    MODEL_MOVED,
    TEST_HALF_USED,
    TEST_ONLY,
    TEST_PARTS_USED,
    Judgement,
    SearchResult,
    has_confirmed_addition,
    is_near_noise,
    is_simpler,
    is_wider_bound_needed,
    judge,
    list_remarks,
)
from analysis.diagnosis.types import Progress, TimeBudget
from equalizer.effects.effect import Effect

LAW_OUTSIDE = "a law outside the catalogue"
"""Name of a further search in the report of an exception (`Guard`)."""
HUM = "mains_hum"
"""Catalogue name of mains hum, for callers that exclude it or test for it separately."""


def prune(context: SearchContext, explanation: Explanation, time_left: TimeBudget) -> Explanation:
    """Remove needless effects (step 2). None are removed where band powers were compared or effects are certain."""
    if explanation.statistic is not None or context.certain:
        return explanation
    if len(explanation.steps) > 1:
        explanation = drop_unconfirmed_effects(context, drop_unnecessary_effects(context, explanation, time_left))
    if context.references is None:
        explanation = drop_negligible_effects(context, explanation)
    return keep_identifiable(context, explanation, time_left)


@dataclass(frozen=True, slots=True)
class FurtherSearches:
    """Searches beyond the catalogue, for a mismatch that the catalogue leaves (step 5). Each returns the result with
    its own effects named in place of the catalogue's, with additional candidates, or unchanged."""

    before_pairs: Callable[[SearchResult], SearchResult] = lambda result: result
    """Called before a second effect is searched for: names only play, or a shorter description than two effects."""
    before_thirds: Callable[[SearchResult], SearchResult] = lambda result: result
    """Called before a third effect is searched for. What explains the whole mismatch ends the search."""
    at_end: Callable[[SearchResult], SearchResult] = lambda result: result
    """Called after the last effect; also with opened held-out samples, where only these show the mismatch."""


def search_effects(
    context: SearchContext,
    catalogue: Sequence[Effect],
    progress: Progress,
    time_left: TimeBudget = grant_time,
    further: FurtherSearches = FurtherSearches(),
) -> SearchResult:
    """Search for effects and judge the result (steps 1 to 5), with the model's own parameters within `Tuning.bound`."""
    further = FurtherSearches(*map(_guard_search, (further.before_pairs, further.before_thirds, further.at_end)))
    single = add_effects(context, catalogue, start_explanation(context, progress), progress, time_left, max_effects=1)
    first_result = SearchResult(context, single, Judgement("unexplained", False))
    if is_worth_searching(context, single, single.after) and judge(single).verdict != "explained":
        first_result = further.before_pairs(first_result)
    found = first_result.found
    is_close = found.statistic is not None or found.after.score.worst_channel <= EXPLAINED_ERROR
    if first_result.judgement.verdict == "explained" and is_close:
        return first_result
    pair = add_effects(context, catalogue, single, progress, time_left, max_effects=2)
    pair = exchange_first_for_relatives(context, pair, catalogue, progress, time_left)
    pair_result = further.before_thirds(replace(first_result, found=pair, unconfirmed=()))
    if pair_result.found is not pair and pair_result.judgement.verdict == "explained":
        return pair_result
    candidates = pair_result.unconfirmed or first_result.unconfirmed
    early_result = replace(first_result, unconfirmed=candidates) if pair_result.found is pair else pair_result
    result = _search_third_effect(context, pair, catalogue, progress, time_left, further.at_end)
    return _choose_early_or_full(early_result, result)


def repeat_with_wider_bound(
    context: SearchContext,
    result: SearchResult,
    catalogue: Sequence[Effect],
    progress: Progress,
    time_left: TimeBudget = grant_time,
) -> SearchResult:
    """Repeat the search with a wider bound of the model's own parameters (step 6), where the result leaves a mismatch
    or needs three effects, and a parameter is at its bound. Returns `result`, with a remark where time ran out, unless
    the new one explains more or with fewer effects (`is_simpler`). context: of the search that gave `result`."""
    if not catalogue or not is_wider_bound_needed(result) or not time_left():
        return result
    progress("searching again, with a model that may move further", 0.1)
    wider_context = replace(context, tuning=context.tuning.with_wider_bound())
    repeated = search_effects(wider_context, catalogue, progress, time_left)
    if not is_simpler(repeated, result):
        is_timed_out = repeated.found.ended_early and OUT_OF_TIME not in result.remarks
        return replace(result, remarks=(*result.remarks, OUT_OF_TIME)) if is_timed_out else result
    unconfirmed = (*result.unconfirmed, *repeated.unconfirmed)
    return replace(repeated, remarks=(MODEL_MOVED, *repeated.remarks), unconfirmed=unconfirmed)


def _choose_early_or_full(early: SearchResult, full: SearchResult) -> SearchResult:
    """Choose the full result, with the early search's candidates where it lists none or time ran out; or the early
    result by a law, where the full search names nothing, or time ran out and its effects leave a far larger error."""
    is_timed_out = full.found.ended_early
    if not early.judgement.named:
        candidates = early.unconfirmed if is_timed_out or not full.unconfirmed else ()
        return replace(full, unconfirmed=(*candidates, *full.unconfirmed))
    if full.judgement.named and not (is_timed_out and has_far_smaller_error(early.found.after, full.found.after)):
        return full
    return replace(early, remarks=(OUT_OF_TIME, *early.remarks)) if is_timed_out else early


def _guard_search(search: Callable[[SearchResult], SearchResult]) -> Callable[[SearchResult], SearchResult]:
    """Wrap a search so that it returns its argument unchanged where it raises an exception (`Guard`)."""
    return lambda result: result.context.guard.run(LAW_OUTSIDE, "its search", lambda: search(result), result)


def _search_third_effect(
    context: SearchContext,
    pair: Explanation,
    catalogue: Sequence[Effect],
    progress: Progress,
    time_left: TimeBudget,
    at_end: Callable[[SearchResult], SearchResult],
) -> SearchResult:
    """Continue the search after at most two effects: exchange, a third effect, elimination, and opened held-out samples
    (steps 1 to 5). pair: the explanation by up to two effects. at_end: `FurtherSearches.at_end`."""
    pair = exchange_first_effects(context, pair, catalogue, progress, time_left)
    final = add_effects(context, catalogue, pair, progress, time_left)
    if final.steps != pair.steps:
        final = exchange_first_effects(context, final, catalogue, progress, time_left)
    final = _prune_guarded(context, final, time_left)
    judgement = _judge_with_prediction(context, final)
    earlier = SearchResult(context, final, judgement, list_remarks(final))
    # Effects that fit their samples are kept even if unconfirmed: another may show in the held-out samples alone.
    fit = final.after if judgement.named or (final.steps and is_near_noise(final)) else final.retuned
    if final.ended_early or final.excluded_name or not has_held_out_mismatch(fit.score.test, fit):
        return at_end(earlier)
    try:
        repeated, adds_effects = _search_with_opened(earlier, fit, catalogue, progress, time_left)
    except OutOfTimeError:
        interrupted = replace(earlier, found=replace(final, ended_early=True), remarks=(OUT_OF_TIME, *earlier.remarks))
        return _mark_unexplained(at_end(interrupted))
    if adds_effects and (judgement.named or repeated.judgement.verdict == "explained"):
        extended = at_end(repeated)
        sample_remarks = tuple(remark for remark in repeated.remarks[:1] if remark not in extended.remarks)
        return replace(extended, remarks=(*sample_remarks, *extended.remarks))
    if judgement.named:
        return at_end(earlier)
    return _search_beyond_catalogue(earlier, repeated, adds_effects, at_end)


def _search_beyond_catalogue(
    earlier: SearchResult, repeated: SearchResult, adds_effects: bool, at_end: Callable[[SearchResult], SearchResult]
) -> SearchResult:
    """Search beyond the catalogue: first without opened held-out samples (`earlier`), then, where that names nothing,
    with them (`repeated`). adds_effects: whether `repeated` adds confirmed effects to `earlier`."""
    without_opened = at_end(earlier)
    if without_opened.judgement.named:
        return without_opened
    judgement = repeated.judgement if adds_effects else replace(repeated.judgement, named=False)
    with_opened = at_end(replace(repeated, judgement=judgement, remarks=()))
    unconfirmed = (*without_opened.unconfirmed, *with_opened.unconfirmed)
    if with_opened.judgement.named:
        return replace(with_opened, remarks=(*repeated.remarks, *with_opened.remarks), unconfirmed=unconfirmed)
    return _mark_unexplained(replace(without_opened, unconfirmed=unconfirmed))


def _mark_unexplained(result: SearchResult) -> SearchResult:
    """Set the verdict "unexplained" where the result names nothing, because held-out samples show a mismatch."""
    final = replace(result.judgement, verdict="unexplained")
    return result if result.judgement.named else replace(result, judgement=final, remarks=(TEST_ONLY, *result.remarks))


def _repeat_with_opened(
    earlier: SearchResult,
    fit: FittedCandidate,
    catalogue: Sequence[Effect],
    progress: Progress,
    time_left: TimeBudget,
    least_parts: int = HALVES,
) -> tuple[SearchResult, int]:
    """Repeat the search with a part of the held-out samples opened (step 4); fit: shows the mismatch. Returns also the
    number of parts into which each stretch was cut; 0 = all but the loudest segments were opened, where both groups
    show the mismatch. least_parts: least number of parts; above 2, all stretches are cut."""
    quieter = earlier.context.open_quieter_segments(fit) if least_parts == HALVES else None
    context, parts = earlier.context.open_alternate_parts(fit, least_parts) if quieter is None else (quieter, 0)
    is_continued = fit is earlier.found.after and is_near_noise(earlier.found)
    previous_steps = earlier.found.rounds[: len(earlier.found.steps)] if is_continued else ()
    final = explain(context, catalogue, progress, time_left, previous_steps)
    final = exchange_first_effects(context, final, catalogue, progress, time_left)
    final = _prune_guarded(context, final, time_left)
    remark = {0: MILDER_TEST_USED, HALVES: TEST_HALF_USED}.get(parts, TEST_PARTS_USED)
    return SearchResult(context, final, _judge_with_prediction(context, final), (remark, *list_remarks(final))), parts


def _search_with_opened(
    earlier: SearchResult, fit: FittedCandidate, catalogue: Sequence[Effect], progress: Progress, time_left: TimeBudget
) -> tuple[SearchResult, bool]:
    """Search with opened samples, and state whether that adds effects to `earlier`. If not, the finest parts are tried
    as well: coarser ones may contain too little of the mismatch, such as none of a few contacts with a stop."""
    repeated, parts = _repeat_with_opened(earlier, fit, catalogue, progress, time_left)
    if _adds_confirmed(earlier, repeated, parts):
        return repeated, True
    has_no_new_site = _list_effect_sites(repeated.found.after) <= _list_effect_sites(earlier.found.after)
    if parts != FINER_PARTS[-1] and has_no_new_site and time_left():
        try:
            finest_result, parts = _repeat_with_opened(earlier, fit, catalogue, progress, time_left, FINER_PARTS[-1])
        except OutOfTimeError:
            return replace(repeated, remarks=(*repeated.remarks, OUT_OF_TIME)), False
        if _adds_confirmed(earlier, finest_result, parts):
            return finest_result, True
    return repeated, False


def _adds_confirmed(earlier: SearchResult, repeated: SearchResult, parts: int) -> bool:
    """Whether the search with opened samples names new effects, confirmed by the samples still held out, in addition to
    all of `earlier`, or to a part of them if the error is then within the noise. parts: as of `_repeat_with_opened`;
    parts finer than halves lie between fitted samples, so that their error must be small (`has_small_error`) compared
    with that without the new effects."""
    earlier_fit, explanation = earlier.found.after if earlier.judgement.named else earlier.found.retuned, repeated.found
    earlier_sites, new_sites = _list_effect_sites(earlier_fit), _list_effect_sites(explanation.after)
    replaces = is_near_noise(explanation) and earlier_sites & new_sites
    if not repeated.judgement.named or not new_sites - earlier_sites or not (earlier_sites <= new_sites or replaces):
        return False
    base, context = explanation.retuned, repeated.context
    if earlier.judgement.named:
        # The first effects are refitted to the opened samples, so that this gain is not credited to the new effect.
        fitted = earlier_fit.fitted
        start = evaluate_fit(context.measure, context.tuning, fitted.deviations, fitted.hypothesis)
        base = context.with_test_score(context.score_fit(refine(context, start)))
        if not has_confirmed_addition(base, explanation.after):
            return False
    return parts <= HALVES or has_small_error(base.compared_by_test(), explanation.after.compared_by_test())


def _list_effect_sites(candidate: FittedCandidate) -> set[tuple[str, int]]:
    """List each effect's name with each of its places."""
    return {(claim.effect.name, site) for claim in candidate.fitted.hypothesis.claims for site in claim.sites}


def _prune_guarded(context: SearchContext, explanation: Explanation, time_left: TimeBudget) -> Explanation:
    """Remove needless effects (`prune`); where that raises an exception, nothing is named."""
    unnamed = replace(explanation, after=explanation.retuned, steps=())
    newest = explanation.steps[-1].newest if explanation.steps else ""
    return context.guard.run(newest, "the final check", lambda: prune(context, explanation, time_left), unnamed)


def _judge_with_prediction(context: SearchContext, explanation: Explanation) -> Judgement:
    """Judge an explanation; "unexplained" where it names effects but predicts nothing (`no_prediction`)."""
    judgement = judge(explanation)
    if judgement.named and has_no_predictive_power(context.full_measure, explanation.after):
        return Judgement("unexplained", False)
    return judgement
