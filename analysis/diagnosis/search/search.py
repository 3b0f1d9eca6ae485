"""The search for missing effects with a given model, from forward selection to verdict.

Theory of operation.

1. Forward selection (`add_effects`) uses the samples to fit and to choose by. After a second effect was found, the
   first may be exchanged for another of its family; after the last, for any effect that fits better
   (`revise_selection`).
2. Backward elimination (`prune`) removes effects without which the others, refitted, fit as well; effects that remove
   too little of the mismatch; and effects whose parameters the data do not determine (`identifiability`: the interval,
   or the profile likelihood, of the only amplitude contains zero).
3. `verdict.judge` compares the errors, in units of the noise, with limits. The errors on held-out samples, which
   neither fitted nor chose anything, can only withdraw names or the verdict "explained".
4. Where only the held-out samples show a mismatch (such as an end stop that only the loudest segment reaches), a part
   of them is used to fit and to choose by, and the search repeated: all but the loudest segments; else the first half
   of each stretch, or every other of more parts. What this finds must be confirmed by the part that is still held out.
5. Where the catalogue leaves a mismatch, `FurtherSearches` is called (laws outside it, `discovery`): before a second
   effect is searched for, because one law that explains everything is a shorter description than two effects, and at
   the end. A law that was found early and leaves a part of the mismatch is kept where the rest of the search names
   nothing. Before a third effect, rattling play is tried (`impacts`): no sum of effects predicts its waveform.
6. Where a mismatch remains, or three effects are needed, and a parameter of the model is at its bound, the search is
   repeated with a wider bound (`move_model_further`): a model that was fitted to this device has absorbed missing
   physics as a bias. The new result is used if it explains what the first does not, or with fewer effects.

The search with reference recordings of the intact device is `reference/search_with_reference`. References: Hastie,
Tibshirani and Friedman, The Elements of Statistical Learning (2009), 7.2 (training, validation, test), 3.3 (stepwise).
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from analysis.diagnosis.errors.output_error import evaluate_fit
from analysis.diagnosis.search.compare_candidates import refine
from analysis.diagnosis.search.explain import Explanation, add_effects, explain, is_worth_searching, start_explanation
from analysis.diagnosis.search.identifiability import keep_identifiable
from analysis.diagnosis.search.no_prediction import is_without_prediction
from analysis.diagnosis.search.parsimony import leaves_far_less
from analysis.diagnosis.search.revise_selection import (
    drop_needless,
    drop_negligible,
    drop_unconfirmed,
    exchange_effects,
    exchange_for_relatives,
)
from analysis.diagnosis.search.search_context import (
    FINER_PARTS,
    HALVES,
    FittedCandidate,
    SearchContext,
    shows_only_held_out,
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
    as_good_as_noise,
    confirms_addition,
    is_plainer,
    judge,
    list_remarks,
    may_move_further,
)
from analysis.diagnosis.settings import EXPLAINED_ERROR, MOST_EFFECTS
from analysis.diagnosis.types import Progress, TimeBudget
from equalizer.effects.effect import Effect

LAW_OUTSIDE = "a law outside the catalogue"
HUM = "mains_hum"


def prune(context: SearchContext, explanation: Explanation, time_left: TimeBudget) -> Explanation:
    """Backward elimination (step 2). Unchanged where band powers were compared, or with effects that are certain."""
    if explanation.statistic is not None or context.certain:
        return explanation
    if len(explanation.steps) > 1:
        explanation = drop_unconfirmed(context, drop_needless(context, explanation, time_left))
    if context.references is None:
        explanation = drop_negligible(context, explanation)
    return keep_identifiable(context, explanation, time_left)


@dataclass(frozen=True, slots=True)
class FurtherSearches:
    """Searches beyond the catalogue, for a mismatch that the catalogue leaves (step 5). Each returns the result with
    its own effects named in place of the catalogue's, with additional candidates, or unchanged."""

    before_pairs: Callable[[SearchResult], SearchResult] = lambda result: result
    """Called before a second effect is searched for: names only what is a shorter description than two effects."""
    before_thirds: Callable[[SearchResult], SearchResult] = lambda result: result
    """Called before a third effect is searched for: names only what explains all that two effects leave."""
    at_end: Callable[[SearchResult], SearchResult] = lambda result: result
    """Called after the last effect; also with opened held-out samples, where only these show the mismatch."""


def search_effects(
    context: SearchContext,
    catalogue: Sequence[Effect],
    progress: Progress,
    time_left: TimeBudget = grant_time,
    further: FurtherSearches = FurtherSearches(),
) -> SearchResult:
    """Steps 1 to 5: the search for effects and its verdict, the model's own parameters being within `Tuning.bound`."""
    further = FurtherSearches(_guard_search(further.before_pairs), further.before_thirds, _guard_search(further.at_end))
    single = add_effects(context, catalogue, start_explanation(context, progress), progress, time_left, max_effects=1)
    first_result = SearchResult(context, single, Judgement("unexplained", False))
    if is_worth_searching(context, single, single.after) and judge(single).verdict != "explained":
        first_result = further.before_pairs(first_result)
    is_explained = first_result.judgement.verdict == "explained"
    if is_explained and first_result.found.after.score.worst_channel <= EXPLAINED_ERROR:
        return first_result
    # With excluded effects, a round that added none cannot be resumed, so that all effects are searched for at once.
    pair = add_effects(context, catalogue, single, progress, time_left, MOST_EFFECTS if context.excluded else 2)
    pair = exchange_for_relatives(context, pair, catalogue, progress, time_left)
    with_play = further.before_thirds(replace(first_result, found=pair))
    if with_play.found is not pair:
        return with_play
    result = _search_with_thirds(context, pair, catalogue, progress, time_left, further.at_end)
    return _choose_early_or_full(first_result, result)


def move_model_further(
    context: SearchContext,
    result: SearchResult,
    catalogue: Sequence[Effect],
    progress: Progress,
    time_left: TimeBudget = grant_time,
) -> SearchResult:
    """Step 6: the search repeated with a wider bound of the model's own parameters, where the result leaves a mismatch
    or needs three effects, and a parameter is at its bound; the result unchanged where the wider bound does not make it
    plainer (`is_plainer`). context: of the search that gave the result."""
    if not catalogue or not may_move_further(result) or not time_left():
        return result
    progress("searching again, with a model that may move further", 0.1)
    wider = replace(context, tuning=context.tuning.with_wider_bound())
    repeated = search_effects(wider, catalogue, progress, time_left)
    if not is_plainer(repeated, result):
        timed_out = repeated.found.ended_early and OUT_OF_TIME not in result.remarks
        return replace(result, remarks=(*result.remarks, OUT_OF_TIME)) if timed_out else result
    unconfirmed = (*result.unconfirmed, *repeated.unconfirmed)
    return replace(repeated, remarks=(MODEL_MOVED, *repeated.remarks), unconfirmed=unconfirmed)


def _choose_early_or_full(early: SearchResult, result: SearchResult) -> SearchResult:
    """The result of the whole search; or the early result by a law, where the whole search names nothing, or where time
    ran out and its named effects leave far more than that law."""
    timed_out = result.found.ended_early
    if not early.judgement.named:
        return replace(result, unconfirmed=(*early.unconfirmed, *result.unconfirmed)) if timed_out else result
    if result.judgement.named and not (timed_out and leaves_far_less(early.found.after, result.found.after)):
        return result
    return replace(early, remarks=(OUT_OF_TIME, *early.remarks)) if timed_out else early


def _guard_search(search: Callable[[SearchResult], SearchResult]) -> Callable[[SearchResult], SearchResult]:
    """The search `add`, which returns its argument unchanged where it crashes."""
    return lambda result: result.context.guard.run(LAW_OUTSIDE, "its search", lambda: search(result), result)


def _search_with_thirds(
    context: SearchContext,
    pair: Explanation,
    catalogue: Sequence[Effect],
    progress: Progress,
    time_left: TimeBudget,
    further: Callable[[SearchResult], SearchResult],
) -> SearchResult:
    """The search after at most two effects: a third one, exchange, elimination, and opened held-out samples (steps 1 to
    5). pair: the explanation by up to two effects. further: `FurtherSearches.at_end`."""
    final = add_effects(context, catalogue, pair, progress, time_left)
    final = _exchange_and_prune(context, final, catalogue, progress, time_left)
    judgement = _judge_with_prediction(context, final)
    first = SearchResult(context, final, judgement, list_remarks(final))
    # Effects that fit their samples are kept even if unconfirmed: another may show in the held-out samples alone.
    base = final.after if judgement.named or (final.steps and as_good_as_noise(final)) else final.retuned
    if final.ended_early or final.barred or not shows_only_held_out(base.score.test, base):
        return further(first)
    try:
        opened, adds_effects = _find_in_parts(first, base, catalogue, progress, time_left)
    except OutOfTimeError:
        interrupted = replace(first, found=replace(final, ended_early=True), remarks=(OUT_OF_TIME, *first.remarks))
        return _mark_unexplained(further(interrupted))
    if adds_effects and (judgement.named or opened.judgement.verdict == "explained"):
        extended = further(opened)
        sample_remarks = tuple(remark for remark in opened.remarks[:1] if remark not in extended.remarks)
        return replace(extended, remarks=(*sample_remarks, *extended.remarks))
    if judgement.named:
        return further(first)
    return _search_further(first, opened, adds_effects, further)


def _search_further(
    first: SearchResult, opened: SearchResult, adds_effects: bool, further: Callable[[SearchResult], SearchResult]
) -> SearchResult:
    """Result of the search beyond the catalogue: first without opened held-out samples, then, where that names nothing,
    with them. adds_effects: whether `opened` adds confirmed effects to `first`."""
    unopened = further(first)
    if unopened.judgement.named:
        return unopened
    judgement = opened.judgement if adds_effects else replace(opened.judgement, named=False)
    with_opened = further(replace(opened, judgement=judgement, remarks=()))
    unconfirmed = (*unopened.unconfirmed, *with_opened.unconfirmed)
    if with_opened.judgement.named:
        return replace(with_opened, remarks=(*opened.remarks, *with_opened.remarks), unconfirmed=unconfirmed)
    return _mark_unexplained(replace(unopened, unconfirmed=unconfirmed))


def _mark_unexplained(result: SearchResult) -> SearchResult:
    """The result; where it names nothing, with the verdict "unexplained", because held-out samples show a mismatch."""
    final = replace(result.judgement, verdict="unexplained")
    return result if result.judgement.named else replace(result, judgement=final, remarks=(TEST_ONLY, *result.remarks))


def _find_with_opened(
    first: SearchResult,
    base: FittedCandidate,
    catalogue: Sequence[Effect],
    progress: Progress,
    time_left: TimeBudget,
    coarsest: int = HALVES,
) -> tuple[SearchResult, int]:
    """Step 4: the search repeated with a part of the held-out samples to fit and to choose by, and the number of parts
    into which each stretch was cut; 0 = all but the loudest segments were opened, where both groups show the mismatch.
    coarsest: least number of parts; above 2, all stretches are cut. base: fit that shows the mismatch."""
    milder = first.context.open_milder(base) if coarsest == HALVES else None
    context, parts = first.context.open_alternate(base, coarsest) if milder is None else (milder, 0)
    continues = base is first.found.after and as_good_as_noise(first.found)
    previous_steps = first.found.rounds[: len(first.found.steps)] if continues else ()
    final = explain(context, catalogue, progress, time_left, previous_steps)
    final = _exchange_and_prune(context, final, catalogue, progress, time_left)
    remark = {0: MILDER_TEST_USED, HALVES: TEST_HALF_USED}.get(parts, TEST_PARTS_USED)
    return SearchResult(context, final, _judge_with_prediction(context, final), (remark, *list_remarks(final))), parts


def _find_in_parts(
    first: SearchResult, base: FittedCandidate, catalogue: Sequence[Effect], progress: Progress, time_left: TimeBudget
) -> tuple[SearchResult, bool]:
    """The result with opened samples, and whether it adds to the first. Where it adds nothing, the finest parts are
    tried as well: coarser ones may contain too little of the mismatch, such as none of a few contacts with a stop."""
    opened, parts = _find_with_opened(first, base, catalogue, progress, time_left)
    if _adds_confirmed(first, opened, parts):
        return opened, True
    has_no_new_site = _list_effect_sites(opened.found.after) <= _list_effect_sites(first.found.after)
    if parts != FINER_PARTS[-1] and has_no_new_site and time_left():
        try:
            finest, parts = _find_with_opened(first, base, catalogue, progress, time_left, FINER_PARTS[-1])
        except OutOfTimeError:
            return replace(opened, remarks=(*opened.remarks, OUT_OF_TIME)), False
        if _adds_confirmed(first, finest, parts):
            return finest, True
    return opened, False


def _adds_confirmed(first: SearchResult, opened: SearchResult, parts: int) -> bool:
    """Whether a search with opened samples names more effects than the first, confirmed by the samples still held out:
    in addition to all named by the first, or to a part of them if that leaves little. parts: as of `_find_with_opened`;
    parts finer than halves lie between fitted samples, so that their error must be at most `EXPLAINED_ERROR`."""
    reference, explanation = first.found.after if first.judgement.named else first.found.retuned, opened.found
    if parts > HALVES and np.nanmax(explanation.after.score.test, initial=0.0) > EXPLAINED_ERROR:
        return False
    earlier_sites, new_sites = _list_effect_sites(reference), _list_effect_sites(explanation.after)
    replaces = as_good_as_noise(explanation) and earlier_sites & new_sites
    if not opened.judgement.named or not new_sites - earlier_sites or not (earlier_sites <= new_sites or replaces):
        return False
    if not first.judgement.named:
        return True
    # The first effects are refitted to the opened samples, so that this gain is not credited to the new effect.
    context, fitted = opened.context, reference.fitted
    start = evaluate_fit(context.measure, context.tuning, fitted.deviations, fitted.hypothesis)
    refitted = context.with_test_score(context.score_fit(refine(context, start)))
    return confirms_addition(refitted, explanation.after)


def _list_effect_sites(candidate: FittedCandidate) -> set[tuple[str, int]]:
    """Each effect's name at each of its places."""
    return {(claim.effect.name, site) for claim in candidate.fitted.hypothesis.claims for site in claim.sites}


def _exchange_and_prune(
    context: SearchContext, initial: Explanation, catalogue: Sequence[Effect], progress: Progress, time_left: TimeBudget
) -> Explanation:
    """Exchange and backward elimination after forward selection; where the elimination crashes, nothing is named."""
    unnamed = replace(initial, after=initial.retuned, steps=())
    exchanged = exchange_effects(context, initial, catalogue, progress, time_left)
    newest = initial.steps[-1].newest if initial.steps else ""
    return context.guard.run(newest, "the final check", lambda: prune(context, exchanged, time_left), unnamed)


def _judge_with_prediction(context: SearchContext, explanation: Explanation) -> Judgement:
    """The judgement; "unexplained" where the explanation predicts nothing (`no_prediction`)."""
    judgement = judge(explanation)
    if judgement.named and is_without_prediction(context.full_measure, explanation.after):
        return Judgement("unexplained", False)
    return judgement
