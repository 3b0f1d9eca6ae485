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
5. Where the catalogue leaves a mismatch, `Beyond` is called (laws outside the catalogue, `discovery`): before a second
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
from analysis.diagnosis.search.explain import Explanation, add_effects, begin, explain, is_worth_searching
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
    shows_there_alone,
)
from analysis.diagnosis.search.time_budget import OUT_OF_TIME, OutOfTimeError, always
from analysis.diagnosis.search.verdict import (
    MILDER_TEST_USED,
    MODEL_MOVED,
    NOT_SHOWN,
    TEST_HALF_USED,
    TEST_PARTS_USED,
    Judgement,
    SearchResult,
    as_good_as_noise,
    confirms_addition,
    is_plainer,
    judge,
    may_move_further,
    search_remarks,
)
from analysis.diagnosis.settings import EXPLAINED_ERROR, MOST_EFFECTS
from analysis.diagnosis.types import Progress, TimeBudget
from equalizer.effects.effect import Effect

LAW_BEYOND = "a law outside the catalogue"
HUM = "mains_hum"


def prune(context: SearchContext, found: Explanation, time_left: TimeBudget) -> Explanation:
    """Backward elimination (step 2). Unchanged where band powers were compared, or with effects that are certain."""
    if found.statistic is not None or context.certain:
        return found
    if len(found.steps) > 1:
        found = drop_unconfirmed(context, drop_needless(context, found, time_left))
    if context.references is None:
        found = drop_negligible(context, found)
    return keep_identifiable(context, found, time_left)


@dataclass(frozen=True, slots=True)
class Beyond:
    """Searches beyond the catalogue, for a mismatch that the catalogue leaves (step 5). Each returns the result with
    its own effects named in place of the catalogue's, with additional candidates, or unchanged."""

    before_pairs: Callable[[SearchResult], SearchResult] = lambda seen: seen
    """Called before a second effect is searched for: names only what is a shorter description than two effects."""
    before_thirds: Callable[[SearchResult], SearchResult] = lambda seen: seen
    """Called before a third effect is searched for: names only what explains all that two effects leave."""
    at_end: Callable[[SearchResult], SearchResult] = lambda seen: seen
    """Called after the last effect; also with opened held-out samples, where only these show the mismatch."""


def search_effects(
    context: SearchContext,
    catalogue: Sequence[Effect],
    progress: Progress,
    time_left: TimeBudget = always,
    beyond: Beyond = Beyond(),
) -> SearchResult:
    """Steps 1 to 5: the search for effects and its verdict, the model's own parameters being within `Tuning.bound`."""
    beyond = Beyond(_guarded(beyond.before_pairs), beyond.before_thirds, _guarded(beyond.at_end))
    alone = add_effects(context, catalogue, begin(context, progress), progress, time_left, most=1)
    early = SearchResult(context, alone, Judgement("unexplained", False))
    if is_worth_searching(context, alone, alone.after) and judge(alone).verdict != "explained":
        early = beyond.before_pairs(early)
    explains = early.judgement.verdict == "explained"
    if explains and early.found.after.score.worst_channel <= EXPLAINED_ERROR:
        return early
    # With excluded effects, a round that added none cannot be resumed, so that all effects are searched for at once.
    pair = add_effects(context, catalogue, alone, progress, time_left, MOST_EFFECTS if context.barred else 2)
    pair = exchange_for_relatives(context, pair, catalogue, progress, time_left)
    rattling = beyond.before_thirds(replace(early, found=pair))
    if rattling.found is not pair:
        return rattling
    result = _search_with_thirds(context, pair, catalogue, progress, time_left, beyond.at_end)
    return _keep_early(early, result)


def move_model_further(
    context: SearchContext,
    result: SearchResult,
    catalogue: Sequence[Effect],
    progress: Progress,
    time_left: TimeBudget = always,
) -> SearchResult:
    """Step 6: the search repeated with a wider bound of the model's own parameters, where the result leaves a mismatch
    or needs three effects, and a parameter is at its bound; the result unchanged where the wider bound does not make it
    plainer (`is_plainer`). context: of the search that gave the result."""
    if not catalogue or not may_move_further(result) or not time_left():
        return result
    progress("searching again, with a model that may move further", 0.1)
    wider = replace(context, tuning=context.tuning.with_wider_bound())
    again = search_effects(wider, catalogue, progress, time_left)
    if not is_plainer(again, result):
        ended = again.found.ended_early and OUT_OF_TIME not in result.remarks
        return replace(result, remarks=(*result.remarks, OUT_OF_TIME)) if ended else result
    unconfirmed = (*result.unconfirmed, *again.unconfirmed)
    return replace(again, remarks=(MODEL_MOVED, *again.remarks), unconfirmed=unconfirmed)


def _keep_early(early: SearchResult, result: SearchResult) -> SearchResult:
    """The result of the whole search; or the early result by a law, where the whole search names nothing, or where time
    ran out and its named effects leave far more than that law."""
    ended = result.found.ended_early
    if not early.judgement.named:
        return replace(result, unconfirmed=(*early.unconfirmed, *result.unconfirmed)) if ended else result
    if result.judgement.named and not (ended and leaves_far_less(early.found.after, result.found.after)):
        return result
    return replace(early, remarks=(OUT_OF_TIME, *early.remarks)) if ended else early


def _guarded(add: Callable[[SearchResult], SearchResult]) -> Callable[[SearchResult], SearchResult]:
    """The search `add`, which returns its argument unchanged where it crashes."""
    return lambda seen: seen.context.guard.part(LAW_BEYOND, "its search", lambda: add(seen), seen)


def _search_with_thirds(
    context: SearchContext,
    pair: Explanation,
    catalogue: Sequence[Effect],
    progress: Progress,
    time_left: TimeBudget,
    beyond: Callable[[SearchResult], SearchResult],
) -> SearchResult:
    """The search after at most two effects: a third one, exchange, elimination, and opened held-out samples (steps 1 to
    5). pair: the explanation by up to two effects. beyond: `Beyond.at_end`."""
    found = add_effects(context, catalogue, pair, progress, time_left)
    found = _exchange_and_prune(context, found, catalogue, progress, time_left)
    judged = _judge_with_prediction(context, found)
    first = SearchResult(context, found, judged, search_remarks(found))
    # Effects that fit their samples are kept even if unconfirmed: another may show in the held-out samples alone.
    left = found.after if judged.named or (found.steps and as_good_as_noise(found)) else found.retuned
    if found.ended_early or found.barred or not shows_there_alone(left.score.test, left):
        return beyond(first)
    try:
        opened, adds = _find_in_parts(first, left, catalogue, progress, time_left)
    except OutOfTimeError:
        ended = replace(first, found=replace(found, ended_early=True), remarks=(OUT_OF_TIME, *first.remarks))
        return _leave_open(beyond(ended))
    if adds and (judged.named or opened.judgement.verdict == "explained"):
        there = beyond(opened)
        said = tuple(remark for remark in opened.remarks[:1] if remark not in there.remarks)
        return replace(there, remarks=(*said, *there.remarks))
    if judged.named:
        return beyond(first)
    return _find_beyond(first, opened, adds, beyond)


def _find_beyond(
    first: SearchResult, opened: SearchResult, adds: bool, beyond: Callable[[SearchResult], SearchResult]
) -> SearchResult:
    """Result of the search beyond the catalogue: first without opened held-out samples, then, where that names nothing,
    with them. adds: whether `opened` adds confirmed effects to `first`."""
    tried = beyond(first)
    if tried.judgement.named:
        return tried
    judged = opened.judgement if adds else replace(opened.judgement, named=False)
    there = beyond(replace(opened, judgement=judged, remarks=()))
    unconfirmed = (*tried.unconfirmed, *there.unconfirmed)
    if there.judgement.named:
        return replace(there, remarks=(*opened.remarks, *there.remarks), unconfirmed=unconfirmed)
    return _leave_open(replace(tried, unconfirmed=unconfirmed))


def _leave_open(result: SearchResult) -> SearchResult:
    """The result; where it names nothing, with the verdict "unexplained", because held-out samples show a mismatch."""
    judged = replace(result.judgement, verdict="unexplained")
    return result if result.judgement.named else replace(result, judgement=judged, remarks=(NOT_SHOWN, *result.remarks))


def _find_with_opened(
    first: SearchResult,
    left: FittedCandidate,
    catalogue: Sequence[Effect],
    progress: Progress,
    time_left: TimeBudget,
    coarsest: int = HALVES,
) -> tuple[SearchResult, int]:
    """Step 4: the search repeated with a part of the held-out samples to fit and to choose by, and the number of parts
    into which each stretch was cut; 0 = all but the loudest segments were opened, where both groups show the mismatch.
    coarsest: least number of parts; above 2, all stretches are cut. left: fit that shows the mismatch."""
    milder = first.context.open_milder(left) if coarsest == HALVES else None
    context, parts = first.context.open_alternate(left, coarsest) if milder is None else (milder, 0)
    going_on = left is first.found.after and as_good_as_noise(first.found)
    begun = first.found.rounds[: len(first.found.steps)] if going_on else ()
    found = explain(context, catalogue, progress, time_left, begun)
    found = _exchange_and_prune(context, found, catalogue, progress, time_left)
    used = {0: MILDER_TEST_USED, HALVES: TEST_HALF_USED}.get(parts, TEST_PARTS_USED)
    return SearchResult(context, found, _judge_with_prediction(context, found), (used, *search_remarks(found))), parts


def _find_in_parts(
    first: SearchResult, left: FittedCandidate, catalogue: Sequence[Effect], progress: Progress, time_left: TimeBudget
) -> tuple[SearchResult, bool]:
    """The result with opened samples, and whether it adds to the first. Where it adds nothing, the finest parts are
    tried as well: coarser ones may contain too little of the mismatch, such as none of a few contacts with a stop."""
    opened, parts = _find_with_opened(first, left, catalogue, progress, time_left)
    if _adds_confirmed(first, opened, parts):
        return opened, True
    no_more = _sites(opened.found.after) <= _sites(first.found.after)
    if parts != FINER_PARTS[-1] and no_more and time_left():
        try:
            finer, parts = _find_with_opened(first, left, catalogue, progress, time_left, FINER_PARTS[-1])
        except OutOfTimeError:
            return replace(opened, remarks=(*opened.remarks, OUT_OF_TIME)), False
        if _adds_confirmed(first, finer, parts):
            return finer, True
    return opened, False


def _adds_confirmed(first: SearchResult, opened: SearchResult, parts: int) -> bool:
    """Whether a search with opened samples names more effects than the first, confirmed by the samples still held out:
    in addition to all named by the first, or to a part of them if that leaves little. parts: as of `_find_with_opened`;
    parts finer than halves lie between fitted samples, so that their error must be at most `EXPLAINED_ERROR`."""
    before, found = first.found.after if first.judgement.named else first.found.retuned, opened.found
    if parts > HALVES and np.nanmax(found.after.score.test, initial=0.0) > EXPLAINED_ERROR:
        return False
    known, named = _sites(before), _sites(found.after)
    instead = as_good_as_noise(found) and known & named
    if not opened.judgement.named or not named - known or not (known <= named or instead):
        return False
    if not first.judgement.named:
        return True
    # The first effects are refitted to the opened samples, so that this gain is not credited to the new effect.
    context, fitted = opened.context, before.fitted
    start = evaluate_fit(context.measure, context.tuning, fitted.deviations, fitted.hypothesis)
    refitted = context.with_test_score(context.candidate(refine(context, start)))
    return confirms_addition(refitted, found.after)


def _sites(candidate: FittedCandidate) -> set[tuple[str, int]]:
    """Each effect's name at each of its places."""
    return {(claim.effect.name, site) for claim in candidate.fitted.hypothesis.claims for site in claim.sites}


def _exchange_and_prune(
    context: SearchContext, found: Explanation, catalogue: Sequence[Effect], progress: Progress, time_left: TimeBudget
) -> Explanation:
    """Exchange and backward elimination after forward selection; where the elimination crashes, nothing is named."""
    nothing = replace(found, after=found.retuned, steps=())
    exchanged = exchange_effects(context, found, catalogue, progress, time_left)
    newest = found.steps[-1].newest if found.steps else ""
    return context.guard.part(newest, "the final check", lambda: prune(context, exchanged, time_left), nothing)


def _judge_with_prediction(context: SearchContext, found: Explanation) -> Judgement:
    """The judgement; "unexplained" where the explanation predicts nothing (`no_prediction`)."""
    judged = judge(found)
    if judged.named and is_without_prediction(context.whole, found.after):
        return Judgement("unexplained", False)
    return judged
