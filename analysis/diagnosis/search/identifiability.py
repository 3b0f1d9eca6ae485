"""Identifiability: an effect is named only where the interval of one of its parameters excludes zero.

Linearised intervals are computed first. Where an effect has one such parameter, and its interval contains zero by a
small margin, the likelihood profile decides: with correlated parameters or a nonlinear law the linearised interval is
too wide. The deviance between the fits without and with an effect needs no derivative. Summed over stretches longer
than the errors' correlation time, its mean over its standard deviation is half of the parameter over its standard
error, for any variance and colour of the residuals (Vuong, Econometrica 57:307, 1989; for a quadratic deviance).
"""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from analysis.diagnosis.errors.error_measure import ErrorMeasure
from analysis.diagnosis.errors.hypothesis import FreeParameter
from analysis.diagnosis.errors.output_error import Fitted, Sensitivity, evaluate_fit
from analysis.diagnosis.errors.standard_errors import (
    STRETCH_S,
    compute_full_sensitivity,
    compute_segment_errors,
    compute_standard_errors,
    finish_fit,
)
from analysis.diagnosis.search.compare_candidates import choose_plainest
from analysis.diagnosis.search.explain import Explanation
from analysis.diagnosis.search.parsimony import is_equal_rival
from analysis.diagnosis.search.revise_selection import remove_effect
from analysis.diagnosis.search.search_context import SearchContext
from analysis.diagnosis.search.short_recordings import shorten_recordings
from analysis.diagnosis.search.time_budget import grant_time
from analysis.diagnosis.settings import (
    INTERVAL_FACTOR,
    MOST_BETWEEN_SEGMENTS,
    REPLACEMENTS_TRIED,
    UNDETERMINED_REACH,
)
from analysis.diagnosis.types import TimeBudget
from equalizer.signals.signal import FloatArray

_ZERO_TOLERANCE = 1e-9
"""Relative distance of a parameter from its null value (no effect) below which it counts as that value."""


def compute_parameter_errors(context: SearchContext, explanation: Explanation) -> FloatArray:
    """(parameters,): standard errors of the final hypothesis's point."""
    if explanation.statistic is not None:
        return explanation.statistic.errors
    return compute_final_errors(context, explanation)[len(context.tuning.names) :]


def compute_final_errors(context: SearchContext, explanation: Explanation) -> FloatArray:
    """(t + parameters,): standard errors of the final fit, of the model's own deviations first."""
    last_candidate = explanation.steps[-1] if explanation.steps else explanation.retuned
    if explanation.errors is not None and explanation.errors[0] is last_candidate.fitted:
        return explanation.errors[1]
    return compute_standard_errors(context.measure, *_evaluate_with_sensitivity(context, last_candidate.fitted))


def compute_interval_errors(context: SearchContext, explanation: Explanation, noise_errors: FloatArray) -> FloatArray:
    """(t + parameters,): standard errors for the stated intervals. noise_errors: from `compute_final_errors`.
    The jackknife error over segments is added in power, up to a multiple of the noise's, because with few segments a
    jackknife has heavy tails. With a single segment, the factor `INTERVAL_FACTOR` is used in its place."""
    last_fit = (explanation.steps[-1] if explanation.steps else explanation.retuned).fitted
    if explanation.jackknife_errors is not None and explanation.jackknife_errors[0] is last_fit:
        jackknife_errors = explanation.jackknife_errors[1]
    else:
        jackknife_errors = compute_segment_errors(context.measure, *_evaluate_with_sensitivity(context, last_fit))
    if jackknife_errors is None:
        return INTERVAL_FACTOR * noise_errors
    return np.asarray(np.hypot(noise_errors, np.minimum(jackknife_errors, MOST_BETWEEN_SEGMENTS * noise_errors)))


def finish_explanation(context: SearchContext, explanation: Explanation, time_left: TimeBudget) -> Explanation:
    """The explanation with its final fit at the minimum, and with its standard errors."""
    last_candidate = explanation.steps[-1]
    if explanation.jackknife_errors is not None and explanation.jackknife_errors[0] is last_candidate.fitted:
        return explanation
    # The last step may have been scored on all samples, held-out ones included.
    start = evaluate_fit(
        context.measure, context.tuning, last_candidate.fitted.deviations, last_candidate.fitted.hypothesis
    )
    fitted, jacobian = _finish_fit(context, start, time_left)
    errors = compute_standard_errors(context.measure, fitted, jacobian)
    jackknife_errors = compute_segment_errors(context.measure, fitted, jacobian)
    if fitted is start:
        return replace(
            explanation,
            errors=(last_candidate.fitted, errors),
            jackknife_errors=(last_candidate.fitted, jackknife_errors),
        )
    candidate = context.score_fit(fitted)
    scored_candidate = context.with_test_score(candidate)
    final_candidate = scored_candidate if last_candidate is explanation.after else candidate
    rounds = tuple(
        tuple(
            final_candidate if round_candidate is last_candidate else round_candidate
            for round_candidate in round_candidates
        )
        for round_candidates in explanation.rounds
    )
    steps = (*explanation.steps[:-1], final_candidate)
    return replace(
        explanation,
        after=scored_candidate,
        rounds=rounds,
        steps=steps,
        errors=(final_candidate.fitted, errors),
        jackknife_errors=(final_candidate.fitted, jackknife_errors),
    )


def _finish_fit(context: SearchContext, fitted: Fitted, time_left: TimeBudget) -> tuple[Fitted, Sensitivity]:
    def compute_jacobian(iterate: Fitted) -> Sensitivity:
        return _compute_sensitivity(context, iterate)

    finished, jacobian = finish_fit(context.measure, context.tuning, fitted, compute_jacobian, time_left)
    # The last steps may deviate slightly from the plain form of a law whose parameters are redundant.
    plainest = choose_plainest(context, finished)
    return (finished, jacobian) if plainest is finished else (plainest, compute_jacobian(plainest))


def _evaluate_with_sensitivity(context: SearchContext, last_fit: Fitted) -> tuple[Fitted, Sensitivity]:
    """The fit on the samples to fit and to choose by, with the sensitivity to all its parameters."""
    fitted = evaluate_fit(context.measure, context.tuning, last_fit.deviations, last_fit.hypothesis)
    return fitted, _compute_sensitivity(context, fitted)


def _compute_sensitivity(context: SearchContext, fitted: Fitted) -> Sensitivity:
    """Sensitivity to all parameters of a fit, on one period of each segment where the drive repeats."""
    short_form = shorten_recordings(context, fitted)
    fit_context = context if short_form is None else short_form.context
    jacobian = compute_full_sensitivity(
        fit_context.measure, fit_context.tuning, fitted.deviations, fitted.hypothesis, fit_context.map_
    )
    return jacobian if short_form is None else short_form.repeat_sensitivity(jacobian)


def keep_identifiable(context: SearchContext, explanation: Explanation, time_left: TimeBudget) -> Explanation:
    """The explanation without effects whose parameters are not identifiable, or another that is as good and
    identifiable; unchanged where all parameters are identifiable."""
    if not explanation.steps:
        return explanation
    explanation = _apply_profile_errors(context, explanation, time_left)
    undetermined_indices = [
        index for index, is_undetermined in enumerate(find_undetermined(context, explanation)) if is_undetermined
    ]
    if not undetermined_indices:
        return explanation
    removed_index = undetermined_indices[-1]
    name = explanation.after.fitted.hypothesis.claims[removed_index].effect.name
    undetermined = (*explanation.undetermined, name)
    if len(explanation.steps) == 1 or (removed_index < len(explanation.steps) - 1 and not time_left()):
        explanation = (
            _find_replacement(context, explanation, time_left) if len(explanation.steps) == 1 else None
        ) or _remove_effects(explanation)
        return replace(explanation, undetermined=undetermined)
    reduced = remove_effect(context, explanation, removed_index)
    rounds = tuple(
        tuple(
            candidate
            for candidate in fitted_candidates
            if candidate.newest != name or any(candidate is step for step in reduced.steps)
        )
        for fitted_candidates in reduced.rounds
    )
    return keep_identifiable(context, replace(reduced, rounds=rounds, undetermined=undetermined), time_left)


def _find_replacement(context: SearchContext, explanation: Explanation, time_left: TimeBudget) -> Explanation | None:
    """Another single effect that is as good and identifiable; None without any."""
    best = explanation.rounds[0][0]
    rivals = tuple(candidate for candidate in explanation.rounds[0] if candidate.newest != best.newest)
    equally_good = {candidate.newest: candidate for candidate in reversed(rivals) if is_equal_rival(best, candidate)}
    for rival in sorted(equally_good.values(), key=lambda candidate: candidate.score.mean_log_error)[
        :REPLACEMENTS_TRIED
    ]:
        remaining = tuple(candidate for candidate in rivals if candidate is not rival)
        replacement = replace(
            explanation,
            after=context.with_test_score(rival),
            rounds=((rival, *remaining),),
            steps=(rival,),
            errors=None,
        )
        replacement = _apply_profile_errors(context, replacement, time_left)
        if not any(find_undetermined(context, replacement)):
            return replacement
    return None


def _remove_effects(explanation: Explanation) -> Explanation:
    return replace(explanation, after=explanation.retuned, steps=())


def _apply_profile_errors(context: SearchContext, explanation: Explanation, time_left: TimeBudget) -> Explanation:
    """The explanation with its final fit at the minimum and the standard errors there. Where the linearised interval of
    an effect's only number includes no effect but its profile does not, the error is the profile's. The profile of an
    effect before the last refits those after it, which is left out where no time is left."""
    if explanation.statistic is None:
        explanation = finish_explanation(context, explanation, time_left)
    errors = compute_final_errors(context, explanation).copy()
    offset = len(context.tuning.names)
    for effect_index, parameters in enumerate(_iterate_null_parameters(explanation, errors[offset:])):
        needs_refit = effect_index < len(explanation.steps) - 1
        if explanation.statistic is not None or len(parameters) != 1 or (needs_refit and not time_left()):
            continue
        parameter, index, coordinate, error = parameters[0]
        half_width, distance = _compute_interval_and_distance(parameter, coordinate, error)
        if not distance < half_width <= UNDETERMINED_REACH * distance:
            continue
        profile_distance = compute_null_distance(context, explanation, effect_index, time_left)
        if profile_distance > 1:
            share = distance / (profile_distance * half_width)
            is_log_scale = parameter.parameter.scale == "log"
            errors[offset + index] = np.log1p(share * np.expm1(error)) if is_log_scale else share * error
    return replace(explanation, errors=(explanation.steps[-1].fitted, errors))


def _iterate_null_parameters(
    explanation: Explanation, errors: FloatArray
) -> Iterator[list[tuple[FreeParameter, int, float, float]]]:
    """Per effect, its parameters that have a null value (no effect), with index, coordinate and standard error."""
    hypothesis, first_entry = explanation.after.fitted.hypothesis, 0
    entries = list(
        zip(hypothesis.parameters, range(len(errors)), hypothesis.point.tolist(), errors.tolist(), strict=True)
    )
    for claim in hypothesis.claims:
        free_count = claim.groups * sum(not p.fixed for p in claim.effect.parameters)
        finite_entries = [
            entry
            for entry in entries[first_entry : first_entry + free_count]
            if np.isfinite(entry[0].parameter.none or 0.0)
        ]
        first_entry += free_count
        yield [entry for entry in finite_entries if entry[0].parameter.none is not None]


def find_undetermined(context: SearchContext, explanation: Explanation) -> Iterator[bool]:
    """Per effect, whether it is undetermined: the intervals of all its parameters with a null value include that."""
    for parameters in _iterate_null_parameters(explanation, compute_parameter_errors(context, explanation)):
        yield bool(parameters) and all(
            _is_undetermined(free, coordinate, error) for free, _, coordinate, error in parameters
        )


def _is_undetermined(free: FreeParameter, coordinate: float, error: float) -> bool:
    """Whether the parameter's interval contains the value that means no effect. error: standard error of its
    coordinate."""
    half_width, distance = _compute_interval_and_distance(free, coordinate, error)
    value, null_value = free.to_value(coordinate), free.parameter.none or 0.0
    return distance <= _ZERO_TOLERANCE * max(abs(value), abs(null_value)) or not half_width <= distance


def _compute_interval_and_distance(free: FreeParameter, coordinate: float, error: float) -> tuple[float, float]:
    """Half width of the parameter's interval, and the distance of its value from no effect."""
    value, null_value = free.to_value(coordinate), free.parameter.none or 0.0
    return 1.96 * INTERVAL_FACTOR * abs(free.to_value(coordinate + error) - value), abs(value - null_value)


def compute_null_distance(
    context: SearchContext, explanation: Explanation, effect: int, time_left: TimeBudget = grant_time
) -> float:
    """Distance of an effect's only parameter from no effect, in half widths of its profile interval; above 1, the
    interval excludes no effect. effect: its index."""
    last_fit = explanation.steps[-1].fitted
    reduced = (
        explanation.retuned if len(explanation.steps) == 1 else remove_effect(context, explanation, effect).steps[-1]
    )
    # The re-tuned model, and at times the last step, is kept as it is on all samples. Both fits end at their minimum:
    # else the difference is not all the effect's.
    start = evaluate_fit(context.measure, context.tuning, reduced.fitted.deviations, reduced.fitted.hypothesis)
    fit_without = _finish_fit(context, start, time_left)[0]
    fit_with = evaluate_fit(context.measure, context.tuning, last_fit.deviations, last_fit.hypothesis)
    deviances = np.concatenate([
        _sum_stretch_squares(context.measure, fit_without) - _sum_stretch_squares(context.measure, fit_with),
        # The calibration is a further observation.
        [float(fit_without.deviations @ fit_without.deviations - fit_with.deviations @ fit_with.deviations)],
    ])  # fmt: skip
    total_deviation = float(np.std(deviances, ddof=1) * np.sqrt(len(deviances)))
    return 2 * float(deviances.sum()) / max(total_deviation, 1e-300) / (1.96 * INTERVAL_FACTOR)


def _sum_stretch_squares(measure: ErrorMeasure, fitted: Fitted) -> FloatArray:
    """(stretches,): sums of squares of the residuals on the fit samples."""
    sums: list[float] = []
    for record, residual in zip(measure.records, fitted.residuals, strict=True):
        square = np.sum(residual[record.fit] ** 2, axis=1)
        width = max(int(STRETCH_S * record.recording.sample_rate_hz), 1)
        sums += [float(square[start : start + width].sum()) for start in range(0, len(square), width)]
    return np.array(sums)
