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
from analysis.diagnosis.errors.intervals import (
    STRETCH_S,
    finish_fit,
    segment_errors,
    sensitivity_to_all,
    standard_errors,
)
from analysis.diagnosis.errors.output_error import Fitted, Sensitivity, evaluate_fit
from analysis.diagnosis.search.compare_candidates import choose_plainest
from analysis.diagnosis.search.explain import Explanation
from analysis.diagnosis.search.parsimony import both_stand
from analysis.diagnosis.search.revise_selection import without_effect
from analysis.diagnosis.search.search_context import SearchContext
from analysis.diagnosis.search.short_recordings import short_recordings_of
from analysis.diagnosis.search.time_budget import always
from analysis.diagnosis.settings import (
    INTERVAL_FACTOR,
    MOST_BETWEEN_SEGMENTS,
    REPLACEMENTS_TRIED,
    UNDETERMINED_REACH,
)
from analysis.diagnosis.types import TimeBudget
from equalizer.signals.signal import FloatArray

_ABSENT = 1e-9


def parameter_errors(context: SearchContext, found: Explanation) -> FloatArray:
    """(parameters,): standard errors of the final hypothesis's point."""
    if found.statistic is not None:
        return found.statistic.errors
    return final_errors(context, found)[len(context.tuning.names) :]


def final_errors(context: SearchContext, found: Explanation) -> FloatArray:
    """(t + parameters,): standard errors of the final fit, of the model's own deviations first."""
    last = found.steps[-1] if found.steps else found.retuned
    if found.errors is not None and found.errors[0] is last.fitted:
        return found.errors[1]
    return standard_errors(context.measure, *_with_sensitivity(context, last.fitted))


def interval_errors(context: SearchContext, found: Explanation, noise: FloatArray) -> FloatArray:
    """(t + parameters,): standard errors for the intervals that are stated. noise: `final_errors`, or their profiles.
    To these comes what varies between segments, up to a few times the noise's: with few segments a jackknife has heavy
    tails. A single segment has no such information, and a factor is used in its place."""
    last = (found.steps[-1] if found.steps else found.retuned).fitted
    if found.between is not None and found.between[0] is last:
        between = found.between[1]
    else:
        between = segment_errors(context.measure, *_with_sensitivity(context, last))
    if between is None:
        return INTERVAL_FACTOR * noise
    return np.asarray(np.hypot(noise, np.minimum(between, MOST_BETWEEN_SEGMENTS * noise)))


def finish(context: SearchContext, found: Explanation, time_left: TimeBudget) -> Explanation:
    """The explanation with its final fit at the minimum, and with its standard errors."""
    last = found.steps[-1]
    if found.between is not None and found.between[0] is last.fitted:
        return found
    # The last step may have been scored on all samples, held-out ones included.
    start = evaluate_fit(context.measure, context.tuning, last.fitted.deviations, last.fitted.hypothesis)
    fitted, known = _finish(context, start, time_left)
    errors = standard_errors(context.measure, fitted, known)
    between = segment_errors(context.measure, fitted, known)
    if fitted is start:
        return replace(found, errors=(last.fitted, errors), between=(last.fitted, between))
    candidate = context.candidate(fitted)
    after = context.with_test_score(candidate)
    done = after if last is found.after else candidate
    rounds = tuple(tuple(done if each is last else each for each in tried) for tried in found.rounds)
    steps = (*found.steps[:-1], done)
    return replace(
        found, after=after, rounds=rounds, steps=steps, errors=(done.fitted, errors), between=(done.fitted, between)
    )


def _finish(context: SearchContext, fitted: Fitted, time_left: TimeBudget) -> tuple[Fitted, Sensitivity]:
    def sensitivity_of(at: Fitted) -> Sensitivity:
        return _sensitivity_of(context, at)

    finished, known = finish_fit(context.measure, context.tuning, fitted, sensitivity_of, time_left)
    # The last steps may leave the plain form of a law by a hair, where two of its parameters do the same.
    plainest = choose_plainest(context, finished)
    return (finished, known) if plainest is finished else (plainest, sensitivity_of(plainest))


def _with_sensitivity(context: SearchContext, last: Fitted) -> tuple[Fitted, Sensitivity]:
    """The fit on the samples to fit and to choose by, with the sensitivity to all its parameters."""
    fitted = evaluate_fit(context.measure, context.tuning, last.deviations, last.hypothesis)
    return fitted, _sensitivity_of(context, fitted)


def _sensitivity_of(context: SearchContext, fitted: Fitted) -> Sensitivity:
    """Sensitivity to all parameters of a fit, on one period of each segment where the drive repeats."""
    short_form = short_recordings_of(context, fitted)
    near = context if short_form is None else short_form.context
    known = sensitivity_to_all(near.measure, near.tuning, fitted.deviations, fitted.hypothesis, near.map_)
    return known if short_form is None else short_form.repeat_sensitivity(known)


def keep_identifiable(context: SearchContext, found: Explanation, time_left: TimeBudget) -> Explanation:
    """The explanation without effects whose parameters are not identifiable, or another that is as good and
    identifiable; unchanged where all parameters are identifiable."""
    if not found.steps:
        return found
    found = _with_profile_errors(context, found, time_left)
    left_open = [number for number, left in enumerate(open_effects(context, found)) if left]
    if not left_open:
        return found
    worst = left_open[-1]
    name = found.after.fitted.hypothesis.claims[worst].effect.name
    known = (*found.undetermined, name)
    if len(found.steps) == 1 or (worst < len(found.steps) - 1 and not time_left()):
        found = (_find_replacement(context, found, time_left) if len(found.steps) == 1 else None) or _without_effects(
            found
        )
        return replace(found, undetermined=known)
    fewer = without_effect(context, found, worst)
    rounds = tuple(
        tuple(each for each in fitted_candidates if each.newest != name or any(each is step for step in fewer.steps))
        for fitted_candidates in fewer.rounds
    )
    return keep_identifiable(context, replace(fewer, rounds=rounds, undetermined=known), time_left)


def _find_replacement(context: SearchContext, found: Explanation, time_left: TimeBudget) -> Explanation | None:
    """Another single effect that is as good and identifiable; None = there is none."""
    best = found.rounds[0][0]
    others = tuple(candidate for candidate in found.rounds[0] if candidate.newest != best.newest)
    as_good = {candidate.newest: candidate for candidate in reversed(others) if both_stand(best, candidate)}
    for other in sorted(as_good.values(), key=lambda candidate: candidate.score.mean_log_error)[:REPLACEMENTS_TRIED]:
        rest = tuple(candidate for candidate in others if candidate is not other)
        instead = replace(
            found, after=context.with_test_score(other), rounds=((other, *rest),), steps=(other,), errors=None
        )
        instead = _with_profile_errors(context, instead, time_left)
        if not any(open_effects(context, instead)):
            return instead
    return None


def _without_effects(found: Explanation) -> Explanation:
    return replace(found, after=found.retuned, steps=())


def _with_profile_errors(context: SearchContext, found: Explanation, time_left: TimeBudget) -> Explanation:
    """The explanation with its final fit at the minimum and the standard errors there. Where the linearised interval of
    an effect's only number includes no effect but its profile does not, the error is the profile's. The profile of an
    effect before the last refits those after it, which is left out where no time is left."""
    if found.statistic is None:
        found = finish(context, found, time_left)
    errors = final_errors(context, found).copy()
    first = len(context.tuning.names)
    for effect, own in enumerate(_parameters_with_none(found, errors[first:])):
        refits = effect < len(found.steps) - 1
        if found.statistic is not None or len(own) != 1 or (refits and not time_left()):
            continue
        number, place, at, error = own[0]
        reach, away = _reach(number, at, error)
        if not away < reach <= UNDETERMINED_REACH * away:
            continue
        sure = distance_from_none(context, found, effect, time_left)
        if sure > 1:
            share = away / (sure * reach)
            by_factor = number.parameter.scale == "log"
            errors[first + place] = np.log1p(share * np.expm1(error)) if by_factor else share * error
    return replace(found, errors=(found.steps[-1].fitted, errors))


def _parameters_with_none(
    found: Explanation, errors: FloatArray
) -> Iterator[list[tuple[FreeParameter, int, float, float]]]:
    """Per effect, its parameters that have a value meaning no effect, with place, coordinate and standard error."""
    hypothesis, first = found.after.fitted.hypothesis, 0
    each = list(zip(hypothesis.parameters, range(len(errors)), hypothesis.point.tolist(), errors.tolist(), strict=True))
    for claim in hypothesis.claims:
        free = claim.groups * sum(not p.fixed for p in claim.effect.parameters)
        own = [number for number in each[first : first + free] if np.isfinite(number[0].parameter.none or 0.0)]
        first += free
        yield [number for number in own if number[0].parameter.none is not None]


def open_effects(context: SearchContext, found: Explanation) -> Iterator[bool]:
    """Whether an effect is open, by effect: the intervals of all its parameters that can mean no effect include it."""
    for own in _parameters_with_none(found, parameter_errors(context, found)):
        yield bool(own) and all(_is_open(free, at, error) for free, _, at, error in own)


def _is_open(free: FreeParameter, at: float, error: float) -> bool:
    """Whether the parameter's interval contains the value that means no effect. error: standard error of its coordinate
    `at`."""
    reach, away = _reach(free, at, error)
    value, none = free.value(at), free.parameter.none or 0.0
    return away <= _ABSENT * max(abs(value), abs(none)) or not reach <= away


def _reach(free: FreeParameter, at: float, error: float) -> tuple[float, float]:
    """Half width of the parameter's interval, and the distance of its value from no effect."""
    value, none = free.value(at), free.parameter.none or 0.0
    return 1.96 * INTERVAL_FACTOR * abs(free.value(at + error) - value), abs(value - none)


def distance_from_none(
    context: SearchContext, found: Explanation, effect: int, time_left: TimeBudget = always
) -> float:
    """Distance of an effect's only parameter from no effect, in half widths of its profile interval; above 1, the
    interval excludes no effect. effect: its place."""
    last = found.steps[-1].fitted
    fewer = found.retuned if len(found.steps) == 1 else without_effect(context, found, effect).steps[-1]
    # The re-tuned model, and at times the last step, is kept as it is on all samples. Both fits end at their minimum:
    # else the difference is not all the effect's.
    start = evaluate_fit(context.measure, context.tuning, fewer.fitted.deviations, fewer.fitted.hypothesis)
    without = _finish(context, start, time_left)[0]
    with_it = evaluate_fit(context.measure, context.tuning, last.deviations, last.hypothesis)
    gained = np.concatenate([
        _stretches(context.measure, without) - _stretches(context.measure, with_it),
        # The calibration is an observation of its own.
        [float(without.deviations @ without.deviations - with_it.deviations @ with_it.deviations)],
    ])  # fmt: skip
    spread = float(np.std(gained, ddof=1) * np.sqrt(len(gained)))
    return 2 * float(gained.sum()) / max(spread, 1e-300) / (1.96 * INTERVAL_FACTOR)


def _stretches(measure: ErrorMeasure, fitted: Fitted) -> FloatArray:
    """(stretches,): sums of squares of the residuals on the fit samples."""
    sums: list[float] = []
    for record, left in zip(measure.records, fitted.residuals, strict=True):
        square = np.sum(left[record.fit] ** 2, axis=1)
        width = max(int(STRETCH_S * record.recording.sample_rate_hz), 1)
        sums += [float(square[begin : begin + width].sum()) for begin in range(0, len(square), width)]
    return np.array(sums)
