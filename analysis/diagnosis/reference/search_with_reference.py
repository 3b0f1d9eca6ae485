"""Search for effects whose contribution exceeds the model error on clean recordings of the same device.

The residual of the re-tuned model on clean recordings (`learn_model_error`) counts as noise in two ways: as coloured
noise, by a whitening filter; and, where the residual exceeds that noise by more than a factor, by its rms only. Effects
that also improve the prediction of the clean recordings are not named, unless they are certain: the model lacks them,
but they are not the fault.
"""

from collections.abc import Sequence
from dataclasses import replace

from analysis.diagnosis.errors.error_measure import ErrorMeasure
from analysis.diagnosis.errors.fit_score import compute_fit_score
from analysis.diagnosis.errors.output_error import evaluate_fit
from analysis.diagnosis.limits import EXPLAINED_ERROR, NOISE_ALONE
from analysis.diagnosis.reference.learn_model_error import LearnedError, add_learned_noise
from analysis.diagnosis.search.compare_candidates import refine
from analysis.diagnosis.search.explain import Explanation
from analysis.diagnosis.search.no_prediction import has_no_predictive_power
from analysis.diagnosis.search.revise_selection import remove_effect
from analysis.diagnosis.search.search import search_effects
from analysis.diagnosis.search.search_context import FittedCandidate, SearchContext
from analysis.diagnosis.search.verdict import Judgement, SearchResult, UnconfirmedEffect
from analysis.diagnosis.types import Progress, TimeBudget
from equalizer.effects.effect import Effect

IMPROVES_CLEAN_REASON = "it improves the prediction of the clean recordings, too, so it was present before the change"
"""Reason, stored in `UnconfirmedEffect`, not to name an effect."""


def search_with_reference(
    context: SearchContext,
    learned_error: LearnedError,
    catalogue: Sequence[Effect],
    progress: Progress,
    time_left: TimeBudget,
) -> SearchResult:
    """Search for effects with the model's error on clean recordings (learned_error) as noise. context: as for a search
    without clean recordings, with the faults that are certain. Residuals of the result are plain, not whitened.
    progress, time_left: as for `search_effects`.

    Where the residual exceeds that noise by more than `ModelErrorFloor.margin_factor`, whitening helps little: effects
    are then also sought with the plain residual, and that result replaces the first where it names effects and has the
    smaller error; not with certain faults, or without time left.
    """
    whitened_result = _withdraw_shared_effects(
        _search_whitened_residual(context, learned_error, catalogue, progress, time_left), learned_error
    )
    if (
        context.certain
        or whitened_result.found.after.score.worst_channel <= learned_error.floor.margin_factor
        or not time_left()
    ):
        return whitened_result
    plain_result = _withdraw_shared_effects(
        _search_plain_residual(context, learned_error, catalogue, progress, time_left), learned_error
    )
    return (
        plain_result
        if plain_result.judgement.named
        and _compute_mean_log_error(whitened_result.context, plain_result)
        < _compute_mean_log_error(whitened_result.context, whitened_result)
        else whitened_result
    )


def _withdraw_shared_effects(result: SearchResult, learned_error: LearnedError) -> SearchResult:
    """Remove effects that also improve the prediction of the clean recordings with the same parameters; these become
    unconfirmed candidates. Unchanged where no effect is named, or faults are certain."""
    explanation, unconfirmed = result.found, []
    for step_index in reversed(
        range(len(explanation.steps) if result.judgement.named and not result.context.certain else 0)
    ):
        hypothesis = explanation.after.fitted.hypothesis
        if not learned_error.references.is_present_on_clean(hypothesis, step_index):
            continue
        unconfirmed.append(UnconfirmedEffect(hypothesis, 0.0, IMPROVES_CLEAN_REASON, step_index))
        explanation = remove_effect(result.context, explanation, step_index)
    if not unconfirmed:
        return result
    judgement = _judge_with_margin(
        result.context.full_measure, explanation, bool(explanation.steps), learned_error.floor.margin_factor
    )
    return replace(result, found=explanation, judgement=judgement, unconfirmed=(*result.unconfirmed, *unconfirmed))


def _compute_mean_log_error(context: SearchContext, result: SearchResult) -> float:
    """Compute the mean logarithm of the error power, with the effects if they are named, by the measure of context."""
    candidate = result.found.after if result.judgement.named else result.found.retuned
    fitted = evaluate_fit(context.measure, context.tuning, candidate.fitted.deviations, candidate.fitted.hypothesis)
    return FittedCandidate(fitted, compute_fit_score(context.measure, fitted.residuals)).score.mean_log_error


def _search_plain_residual(
    context: SearchContext,
    learned_error: LearnedError,
    catalogue: Sequence[Effect],
    progress: Progress,
    time_left: TimeBudget,
) -> SearchResult:
    """Search on the plain residual, with the model error on clean recordings, raised by its factor, as white noise."""
    raised_floor = replace(
        learned_error.floor,
        channels=tuple(learned_error.floor.margin_factor * channel for channel in learned_error.floor.channels),
    )
    noise_measure = add_learned_noise(context.full_measure, raised_floor)
    search_context = replace(
        context, measure=noise_measure.shorten(), full_measure=noise_measure, least_remaining_error=EXPLAINED_ERROR
    )
    result = search_effects(search_context, catalogue, progress, time_left)
    full_measure = add_learned_noise(context.full_measure, learned_error.floor).with_records(
        result.context.full_measure.records
    )
    final_context = replace(context, measure=full_measure.shorten(), full_measure=full_measure)
    return replace(result, context=final_context, found=_refit_on_plain_residual(final_context, result.found))


def _search_whitened_residual(
    context: SearchContext,
    learned_error: LearnedError,
    catalogue: Sequence[Effect],
    progress: Progress,
    time_left: TimeBudget,
) -> SearchResult:
    """Search on the whitened residual; the result is refitted and judged on the plain one."""
    plain_measure = add_learned_noise(context.full_measure, learned_error.floor)
    whitened_measure = learned_error.make_noise_measure(plain_measure, context.tuning.model)
    # Model error is not random noise: even the right law may leave more than its learned size.
    least_error = EXPLAINED_ERROR * learned_error.references.gain_factor
    search_context = replace(
        context,
        measure=whitened_measure.shorten(),
        full_measure=whitened_measure,
        references=learned_error.references,
        least_remaining_error=least_error,
    )
    result = search_effects(search_context, catalogue, progress, time_left)
    plain_measure = plain_measure.with_records(result.context.full_measure.records)
    final_context = replace(context, measure=plain_measure.shorten(), full_measure=plain_measure)
    explanation = _refit_on_plain_residual(final_context, result.found)
    if context.certain:
        return replace(
            result,
            context=final_context,
            found=explanation,
            judgement=_judge_with_margin(plain_measure, explanation, True, learned_error.floor.margin_factor),
            remarks=(),
        )
    is_named = result.judgement.named and not has_no_predictive_power(plain_measure, explanation.after)
    return replace(
        result,
        context=final_context,
        found=explanation,
        judgement=_judge_with_margin(plain_measure, explanation, is_named, learned_error.floor.margin_factor),
    )


def _judge_with_margin(
    measure: ErrorMeasure, explanation: Explanation, is_named: bool, margin_factor: float
) -> Judgement:
    """Judge the result with the thresholds raised by `margin_factor`, because devices may differ from day to day.
    measure: that of the residuals in `explanation`; its scores may be those of a whitened measure, which does not show
    slow changes."""
    if is_named:
        return Judgement(
            "explained"
            if explanation.after.score.worst_channel <= margin_factor * EXPLAINED_ERROR
            else "partly_explained",
            True,
        )
    plain_error = compute_fit_score(measure, explanation.before.fitted.residuals).worst_channel
    if max(plain_error, explanation.before.score.worst_channel) <= margin_factor * NOISE_ALONE:
        return Judgement("no_mismatch", False)
    return Judgement(
        "parameters" if explanation.retuned.score.worst_channel <= margin_factor * NOISE_ALONE else "unexplained", False
    )


def _refit_on_plain_residual(context: SearchContext, explanation: Explanation) -> Explanation:
    """Refit the parameters of the effects on the plain residual: a fit to the whitened residual may bias the parameters
    of a law that is not exact. Without effects, and with certain faults, only the residuals are replaced."""
    final_fit = explanation.after.fitted
    if final_fit.hypothesis.claims and not context.certain:
        start = evaluate_fit(context.measure, context.tuning, final_fit.deviations, final_fit.hypothesis)
        final_fit = refine(context, start)
    steps = [*explanation.steps[:-1], *(replace(step, fitted=final_fit) for step in explanation.steps[-1:])]
    return replace(
        explanation,
        before=_evaluate_by_measure(context.full_measure, context, explanation.before),
        retuned=_evaluate_by_measure(context.full_measure, context, explanation.retuned),
        after=_evaluate_by_measure(context.full_measure, context, replace(explanation.after, fitted=final_fit)),
        steps=tuple(_evaluate_by_measure(context.measure, context, step) for step in steps),
    )


def _evaluate_by_measure(measure: ErrorMeasure, context: SearchContext, candidate: FittedCandidate) -> FittedCandidate:
    """Replace the residuals of a candidate by those of this measure, at the same parameters; its score is unchanged."""
    return replace(
        candidate,
        fitted=evaluate_fit(measure, context.tuning, candidate.fitted.deviations, candidate.fitted.hypothesis),
    )
