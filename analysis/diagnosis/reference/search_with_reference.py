"""Search for effects whose contribution exceeds the model error on clean recordings of the same device.

The residual of the re-tuned model on clean recordings (`learn_model_error`) counts as noise in two ways: as coloured
noise, by a whitening filter; and, where the residual is much larger than that noise, by its rms only. Effects that also
improve the prediction of the clean recordings are not named: the model lacks them, but they are not the fault.
"""

from collections.abc import Sequence
from dataclasses import replace

from analysis.diagnosis.errors.error_measure import ErrorMeasure
from analysis.diagnosis.errors.fit_score import fit_score
from analysis.diagnosis.errors.output_error import evaluate_fit
from analysis.diagnosis.reference.learn_model_error import LearnedError, count_as_noise
from analysis.diagnosis.search.compare_candidates import refine
from analysis.diagnosis.search.explain import Explanation
from analysis.diagnosis.search.no_prediction import is_without_prediction
from analysis.diagnosis.search.revise_selection import without_effect
from analysis.diagnosis.search.search import search_effects
from analysis.diagnosis.search.search_context import FittedCandidate, SearchContext
from analysis.diagnosis.search.verdict import Judgement, SearchResult, Unconfirmed
from analysis.diagnosis.settings import EXPLAINED_ERROR, NOISE_ALONE
from analysis.diagnosis.types import Progress, TimeBudget
from equalizer.effects.effect import Effect

THERE_BEFORE = "it improves the prediction of the clean recordings, too, so it was present before the change"


def search_with_reference(
    context: SearchContext,
    learned: LearnedError,
    catalogue: Sequence[Effect],
    progress: Progress,
    time_left: TimeBudget,
) -> SearchResult:
    """Search with the model's error on clean recordings (learned) as noise. context: as without clean recordings, with
    the faults that are certain. Residuals of the result are by its own measure, with that model error as noise.

    Where the residual is much larger, whitening helps little: effects are then also searched for with the plain
    residual, and the result with the smaller error is kept.
    """
    fine = _unname_what_was_there(_search_by_contrast(context, learned, catalogue, progress, time_left), learned)
    if context.certain or fine.found.after.score.worst_channel <= learned.floor.beyond or not time_left():
        return fine
    coarse = _unname_what_was_there(_search_by_size(context, learned, catalogue, progress, time_left), learned)
    return (
        coarse
        if coarse.judgement.named and _mean_log_error(fine.context, coarse) < _mean_log_error(fine.context, fine)
        else fine
    )


def _unname_what_was_there(seen: SearchResult, learned: LearnedError) -> SearchResult:
    """The result without effects that the clean recordings show with the same parameters; these become unconfirmed."""
    found, before = seen.found, []
    for place in reversed(range(len(found.steps) if seen.judgement.named and not seen.context.certain else 0)):
        whole = found.after.fitted.hypothesis
        if not learned.references.hold(whole, place):
            continue
        before.append(Unconfirmed(whole, 0.0, THERE_BEFORE, place))
        found = without_effect(seen.context, found, place)
    if not before:
        return seen
    judged = _judge_with_floor(seen.context.whole, found, bool(found.steps), learned.floor.beyond)
    return replace(seen, found=found, judgement=judged, unconfirmed=(*seen.unconfirmed, *before))


def _mean_log_error(context: SearchContext, seen: SearchResult) -> float:
    """Mean log error power with the named effects, on the samples to fit and to choose by."""
    stands = seen.found.after if seen.judgement.named else seen.found.retuned
    fitted = evaluate_fit(context.measure, context.tuning, stands.fitted.deviations, stands.fitted.hypothesis)
    return FittedCandidate(fitted, fit_score(context.measure, fitted.residuals)).score.mean_log_error


def _search_by_size(
    context: SearchContext,
    learned: LearnedError,
    catalogue: Sequence[Effect],
    progress: Progress,
    time_left: TimeBudget,
) -> SearchResult:
    """Search on the plain residual, with the model error on clean recordings, raised by its factor, as white noise."""
    wide = replace(learned.floor, channels=tuple(learned.floor.beyond * channel for channel in learned.floor.channels))
    plain = count_as_noise(context.whole, wide)
    beside = replace(context, measure=plain.shorten(), whole=plain, least_left=EXPLAINED_ERROR)
    seen = search_effects(beside, catalogue, progress, time_left)
    back = count_as_noise(context.whole, learned.floor).with_records(seen.context.whole.records)
    own = replace(context, measure=back.shorten(), whole=back)
    return replace(seen, context=own, found=_refit_by(own, seen.found))


def _search_by_contrast(
    context: SearchContext,
    learned: LearnedError,
    catalogue: Sequence[Effect],
    progress: Progress,
    time_left: TimeBudget,
) -> SearchResult:
    """Search on the whitened residual; the result is refitted and judged on the plain one."""
    plain = count_as_noise(context.whole, learned.floor)
    whole = learned.noise_measure(plain, context.tuning.model)
    # Model error is not random noise: even the right law leaves more than its learned size.
    least_left = EXPLAINED_ERROR * learned.references.beyond
    beside = replace(
        context, measure=whole.shorten(), whole=whole, references=learned.references, least_left=least_left
    )
    seen = search_effects(beside, catalogue, progress, time_left)
    plain = plain.with_records(seen.context.whole.records)
    back = replace(context, measure=plain.shorten(), whole=plain)
    found = _refit_by(back, seen.found)
    if context.certain:
        return replace(
            seen,
            context=back,
            found=found,
            judgement=_judge_with_floor(plain, found, True, learned.floor.beyond),
            remarks=(),
        )
    named = seen.judgement.named and not is_without_prediction(plain, found.after)
    return replace(
        seen, context=back, found=found, judgement=_judge_with_floor(plain, found, named, learned.floor.beyond)
    )


def _judge_with_floor(measure: ErrorMeasure, found: Explanation, named: bool, beyond: float) -> Judgement:
    """The verdict, with all thresholds raised by the factor `beyond`, because devices differ from day to day. measure:
    that of the result's residuals; scores may be of a whitened one, which does not show slow changes."""
    if named:
        return Judgement(
            "explained" if found.after.score.worst_channel <= beyond * EXPLAINED_ERROR else "partly_explained", True
        )
    plain = fit_score(measure, found.before.fitted.residuals).worst_channel
    if max(plain, found.before.score.worst_channel) <= beyond * NOISE_ALONE:
        return Judgement("no_mismatch", False)
    return Judgement(
        "parameters" if found.retuned.score.worst_channel <= beyond * NOISE_ALONE else "unexplained", False
    )


def _refit_by(context: SearchContext, found: Explanation) -> Explanation:
    """The explanation with its parameters refitted on the plain residual. Effects are chosen on the whitened residual,
    which would bias the parameters of a law that is not exact."""
    after = found.after.fitted
    if after.hypothesis.claims and not context.certain:
        start = evaluate_fit(context.measure, context.tuning, after.deviations, after.hypothesis)
        after = refine(context, start)
    steps = [*found.steps[:-1], *(replace(step, fitted=after) for step in found.steps[-1:])]
    return replace(
        found,
        before=_evaluate_by(context.whole, context, found.before),
        retuned=_evaluate_by(context.whole, context, found.retuned),
        after=_evaluate_by(context.whole, context, replace(found.after, fitted=after)),
        steps=tuple(_evaluate_by(context.measure, context, step) for step in steps),
    )


def _evaluate_by(measure: ErrorMeasure, context: SearchContext, candidate: FittedCandidate) -> FittedCandidate:
    """The candidate with its residuals by this measure, at the same parameters; its score is unchanged."""
    return replace(
        candidate,
        fitted=evaluate_fit(measure, context.tuning, candidate.fitted.deviations, candidate.fitted.hypothesis),
    )
