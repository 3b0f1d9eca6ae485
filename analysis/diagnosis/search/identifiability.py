"""Remove effects that the data do not identify: the intervals of their parameters include the null value (no effect).

Linearised intervals are computed first. Where an effect has one such parameter, and its interval contains that value by
a small margin, the likelihood profile decides: with correlated parameters or a nonlinear law the linearised interval is
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
from analysis.diagnosis.limits import (
    INTERVAL_FACTOR,
    INTERVAL_HALF_WIDTH,
    MOST_BETWEEN_SEGMENTS,
    REPLACEMENTS_TRIED,
    UNDETERMINED_REACH,
)
from analysis.diagnosis.search.compare_candidates import choose_plainest
from analysis.diagnosis.search.explain import Explanation
from analysis.diagnosis.search.parsimony import is_equal_rival
from analysis.diagnosis.search.revise_selection import remove_effect
from analysis.diagnosis.search.search_context import SearchContext
from analysis.diagnosis.search.short_recordings import shorten_recordings
from analysis.diagnosis.search.time_budget import grant_time
from analysis.diagnosis.types import TimeBudget
from equalizer.signals.signal import FloatArray

_ZERO_TOLERANCE = 1e-9
"""Relative distance of a parameter from its null value (no effect) up to which it counts as that value. Chosen."""


def compute_parameter_errors(context: SearchContext, explanation: Explanation) -> FloatArray:
    """Compute (parameters,): standard errors of the final hypothesis's point."""
    if explanation.statistic is not None:
        return explanation.statistic.errors
    return compute_final_errors(context, explanation)[len(context.tuning.names) :]


def compute_final_errors(context: SearchContext, explanation: Explanation) -> FloatArray:
    """Compute (t + parameters,): standard errors of the final fit, of the model's t deviations first."""
    last_candidate = explanation.steps[-1] if explanation.steps else explanation.retuned
    if explanation.errors is not None and explanation.errors[0] is last_candidate.fitted:
        return explanation.errors[1]
    return compute_standard_errors(context.measure, *_evaluate_with_sensitivity(context, last_candidate.fitted))


def compute_interval_errors(context: SearchContext, explanation: Explanation, noise_errors: FloatArray) -> FloatArray:
    """Compute (t + parameters,): standard errors for the stated intervals. noise_errors: from `compute_final_errors`.
    The jackknife error over segments is added in power, up to `MOST_BETWEEN_SEGMENTS` times the noise's, because with
    few segments a jackknife has heavy tails. With a single segment, the factor `INTERVAL_FACTOR` is used instead."""
    last_fit = (explanation.steps[-1] if explanation.steps else explanation.retuned).fitted
    if explanation.jackknife_errors is not None and explanation.jackknife_errors[0] is last_fit:
        jackknife_errors = explanation.jackknife_errors[1]
    else:
        jackknife_errors = compute_segment_errors(context.measure, *_evaluate_with_sensitivity(context, last_fit))
    if jackknife_errors is None:
        return INTERVAL_FACTOR * noise_errors
    return np.asarray(np.hypot(noise_errors, np.minimum(jackknife_errors, MOST_BETWEEN_SEGMENTS * noise_errors)))


def finish_explanation(context: SearchContext, explanation: Explanation, time_left: TimeBudget) -> Explanation:
    """Continue the final fit of an explanation, with at least one step, to its minimum, and add standard errors there;
    unchanged where it has them."""
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
    """Continue a fit to its minimum; returns it, or the plainest form of its laws, with its sensitivity."""

    def compute_jacobian(iterate: Fitted) -> Sensitivity:
        return _compute_sensitivity(context, iterate)

    finished_fit, jacobian = finish_fit(context.measure, context.tuning, fitted, compute_jacobian, time_left)
    # The last steps may deviate slightly from the plain form of a law whose parameters are redundant.
    plainest_fit = choose_plainest(context, finished_fit)
    return (finished_fit, jacobian) if plainest_fit is finished_fit else (plainest_fit, compute_jacobian(plainest_fit))


def _evaluate_with_sensitivity(context: SearchContext, last_fit: Fitted) -> tuple[Fitted, Sensitivity]:
    """Evaluate a fit on the samples to fit and to choose by, with the sensitivity to all its parameters."""
    fitted = evaluate_fit(context.measure, context.tuning, last_fit.deviations, last_fit.hypothesis)
    return fitted, _compute_sensitivity(context, fitted)


def _compute_sensitivity(context: SearchContext, fitted: Fitted) -> Sensitivity:
    """Compute the sensitivity to all parameters of a fit, on one period of each segment where the drive repeats."""
    short_form = shorten_recordings(context, fitted)
    fit_context = context if short_form is None else short_form.context
    jacobian = compute_full_sensitivity(
        fit_context.measure, fit_context.tuning, fitted.deviations, fitted.hypothesis, fit_context.map_
    )
    return jacobian if short_form is None else short_form.repeat_sensitivity(jacobian)


def keep_identifiable(context: SearchContext, explanation: Explanation, time_left: TimeBudget) -> Explanation:
    """Remove effects whose parameters are not identifiable, the last first; a single one is replaced by an equal rival
    that is identifiable, if there is one. All are removed where those after it cannot be refitted, because no time is
    left. Where all are identifiable, only the fit is continued to its minimum."""
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
    undetermined_names = (*explanation.undetermined, name)
    if len(explanation.steps) == 1 or (removed_index < len(explanation.steps) - 1 and not time_left()):
        explanation = (
            _find_replacement(context, explanation, time_left) if len(explanation.steps) == 1 else None
        ) or replace(explanation, after=explanation.retuned, steps=())
        return replace(explanation, undetermined=undetermined_names)
    reduced = remove_effect(context, explanation, removed_index)
    rounds = tuple(
        tuple(
            candidate
            for candidate in fitted_candidates
            if candidate.newest != name or any(candidate is step for step in reduced.steps)
        )
        for fitted_candidates in reduced.rounds
    )
    return keep_identifiable(context, replace(reduced, rounds=rounds, undetermined=undetermined_names), time_left)


def _find_replacement(context: SearchContext, explanation: Explanation, time_left: TimeBudget) -> Explanation | None:
    """Find an equally good and identifiable single effect among `REPLACEMENTS_TRIED` rivals; None without any."""
    named = explanation.rounds[0][0]
    rivals = tuple(candidate for candidate in explanation.rounds[0] if candidate.newest != named.newest)
    equal_rivals = {candidate.newest: candidate for candidate in reversed(rivals) if is_equal_rival(named, candidate)}
    for rival in sorted(equal_rivals.values(), key=lambda candidate: candidate.score.mean_log_error)[
        :REPLACEMENTS_TRIED
    ]:
        other_rivals = tuple(candidate for candidate in rivals if candidate is not rival)
        replacement = replace(
            explanation,
            after=context.with_test_score(rival),
            rounds=((rival, *other_rivals),),
            steps=(rival,),
            errors=None,
        )
        replacement = _apply_profile_errors(context, replacement, time_left)
        if not any(find_undetermined(context, replacement)):
            return replacement
    return None


def _apply_profile_errors(context: SearchContext, explanation: Explanation, time_left: TimeBudget) -> Explanation:
    """Continue the final fit to its minimum, and add the standard errors there. Where the linearised interval of an
    effect's only parameter includes the null value, but its profile does not, the error is the profile's. The profile
    of an effect before the last refits those after it, and is omitted where no time is left."""
    if explanation.statistic is None:
        explanation = finish_explanation(context, explanation, time_left)
    errors = compute_final_errors(context, explanation).copy()
    tuned_count = len(context.tuning.names)
    for effect_index, parameters in enumerate(_iterate_null_parameters(explanation, errors[tuned_count:])):
        needs_refit = effect_index < len(explanation.steps) - 1
        if explanation.statistic is not None or len(parameters) != 1 or (needs_refit and not time_left()):
            continue
        parameter, parameter_index, coordinate, error = parameters[0]
        half_width, distance = _compute_interval_and_distance(parameter, coordinate, error)
        if not distance < half_width <= UNDETERMINED_REACH * distance:
            continue
        profile_distance = compute_null_distance(context, explanation, effect_index, time_left)
        if profile_distance > 1:
            ratio = distance / (profile_distance * half_width)
            is_log_scale = parameter.parameter.scale == "log"
            errors[tuned_count + parameter_index] = np.log1p(ratio * np.expm1(error)) if is_log_scale else ratio * error
    return replace(explanation, errors=(explanation.steps[-1].fitted, errors))


def _iterate_null_parameters(
    explanation: Explanation, errors: FloatArray
) -> Iterator[list[tuple[FreeParameter, int, float, float]]]:
    """Iterate over the effects: the parameters of each that have a finite null value (no effect), with index,
    coordinate and standard error."""
    hypothesis, first_entry = explanation.after.fitted.hypothesis, 0
    entries = list(
        zip(hypothesis.parameters, range(len(errors)), hypothesis.point.tolist(), errors.tolist(), strict=True)
    )
    for claim in hypothesis.claims:
        free_count = claim.group_count * sum(not parameter.fixed for parameter in claim.effect.parameters)
        finite_entries = [
            entry
            for entry in entries[first_entry : first_entry + free_count]
            if np.isfinite(entry[0].parameter.none or 0.0)
        ]
        first_entry += free_count
        yield [entry for entry in finite_entries if entry[0].parameter.none is not None]


def find_undetermined(context: SearchContext, explanation: Explanation) -> Iterator[bool]:
    """Iterate over the effects: whether each is undetermined, because the intervals of all its parameters with a null
    value include that value; False without such parameters."""
    for parameters in _iterate_null_parameters(explanation, compute_parameter_errors(context, explanation)):
        yield bool(parameters) and all(
            _is_undetermined(parameter, coordinate, error) for parameter, _, coordinate, error in parameters
        )


def _is_undetermined(parameter: FreeParameter, coordinate: float, error: float) -> bool:
    """Whether the parameter's interval contains the value that means no effect. error: standard error of its
    coordinate."""
    half_width, distance = _compute_interval_and_distance(parameter, coordinate, error)
    value, null_value = parameter.to_value(coordinate), parameter.parameter.none or 0.0
    return distance <= _ZERO_TOLERANCE * max(abs(value), abs(null_value)) or not half_width <= distance


def _compute_interval_and_distance(parameter: FreeParameter, coordinate: float, error: float) -> tuple[float, float]:
    """Compute the half width of the parameter's 95 % interval (`INTERVAL_HALF_WIDTH`; infinite for an infinite error),
    and the distance of its value from its null value."""
    value, null_value = parameter.to_value(coordinate), parameter.parameter.none or 0.0
    width = abs(parameter.to_value(coordinate + error) - value) if np.isfinite(error) else np.inf  # no limit of values
    return INTERVAL_HALF_WIDTH * width, abs(value - null_value)


def compute_null_distance(
    context: SearchContext, explanation: Explanation, index: int, time_left: TimeBudget = grant_time
) -> float:
    """Compute the distance of an effect's only parameter from its null value, in half widths of its profile interval;
    above 1, the interval excludes the null value. index: of the effect."""
    last_fit = explanation.steps[-1].fitted
    reduced = (
        explanation.retuned if len(explanation.steps) == 1 else remove_effect(context, explanation, index).steps[-1]
    )
    # The re-tuned model, and sometimes the last step, were evaluated on all samples. Both fits must be at their
    # minimum: else the difference is not that of the effect alone.
    start = evaluate_fit(context.measure, context.tuning, reduced.fitted.deviations, reduced.fitted.hypothesis)
    fit_without = _finish_fit(context, start, time_left)[0]
    fit_with = evaluate_fit(context.measure, context.tuning, last_fit.deviations, last_fit.hypothesis)
    deviances = np.concatenate([
        _sum_stretch_squares(context.measure, fit_without) - _sum_stretch_squares(context.measure, fit_with),
        # The calibration is a further observation.
        [float(fit_without.deviations @ fit_without.deviations - fit_with.deviations @ fit_with.deviations)],
    ])  # fmt: skip
    total_deviation = float(np.std(deviances, ddof=1) * np.sqrt(len(deviances)))
    return 2 * float(deviances.sum()) / max(total_deviation, 1e-300) / INTERVAL_HALF_WIDTH


def _sum_stretch_squares(measure: ErrorMeasure, fitted: Fitted) -> FloatArray:
    """Sum the squared residuals on the samples to fit over stretches of `STRETCH_S`, (stretches,)."""
    square_sums: list[float] = []
    for record, residual in zip(measure.records, fitted.residuals, strict=True):
        squares = np.sum(residual[record.fit] ** 2, axis=1)
        length = max(int(STRETCH_S * record.recording.sample_rate_hz), 1)
        square_sums += [float(squares[start : start + length].sum()) for start in range(0, len(squares), length)]
    return np.array(square_sums)
