"""Identifiability: an effect whose numbers the recordings leave undetermined is not named."""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from analysis.diagnosis.errors.hypothesis import Number
from analysis.diagnosis.errors.intervals import standard_errors
from analysis.diagnosis.errors.output_error import evaluated
from analysis.diagnosis.search.explain import Explanation
from analysis.diagnosis.search.parsimony import both_stand
from analysis.diagnosis.search.search_context import SearchContext, sensitivity_at
from analysis.diagnosis.search.short_recordings import short_recordings_of
from analysis.diagnosis.search.without_effect import without_effect
from analysis.diagnosis.settings import INTERVAL_FACTOR, REPLACEMENTS_TRIED, UNDETERMINED_REACH
from analysis.diagnosis.types import TimeBudget
from equalizer.signals.signal import FloatArray

_ABSENT = 1e-9


def number_errors(context: SearchContext, found: Explanation) -> FloatArray:
    """(numbers,): standard errors of the final hypothesis's point."""
    if found.statistic is not None:
        return found.statistic.errors
    return final_errors(context, found)[len(context.tuning.names) :]


def final_errors(context: SearchContext, found: Explanation) -> FloatArray:
    """(t + numbers,): standard errors of the final fit, of the model's own deviations first. Beside a single body, what
    a force along the motion changes in the sensitivity to its numbers is not left out: that costs three runs."""
    last = found.steps[-1] if found.steps else found.retuned
    if found.errors is not None and found.errors[0] is last.fitted:
        return found.errors[1]
    fitted = evaluated(context.measure, context.tuning, last.fitted.deviations, last.fitted.hypothesis)
    single = context.tuning.model.coordinates == 1
    short_form = short_recordings_of(context, fitted.hypothesis)
    near = context if short_form is None else short_form.context
    known = sensitivity_at(near, fitted.deviations, fitted.hypothesis, with_forces=single)
    known = known if short_form is None else short_form.repeated(known)
    return standard_errors(context.measure, context.tuning, fitted, known)


def identified(context: SearchContext, found: Explanation, time_left: TimeBudget) -> Explanation:
    """The same where all numbers are determined; else without the effects whose numbers are not, or with an explanation
    that is as good and whose numbers are determined."""
    if not found.steps:
        return found
    found = replace(found, errors=(found.steps[-1].fitted, final_errors(context, found)))
    left_open = [number for number, is_open in enumerate(_open(context, found)) if is_open]
    if not left_open:
        return found
    worst = left_open[-1]
    name = found.after.fitted.hypothesis.claims[worst].effect.name
    known = (*found.undetermined, name)
    if len(found.steps) == 1 or (worst < len(found.steps) - 1 and not time_left()):
        found = (_instead(context, found) if len(found.steps) == 1 else None) or _nothing(found)
        return replace(found, undetermined=known)
    fewer = without_effect(context, found, worst)
    rounds = tuple(
        tuple(candidate for candidate in fitted_candidates if candidate.newest != name)
        for fitted_candidates in fewer.rounds
    )
    return identified(context, replace(fewer, rounds=rounds, undetermined=known), time_left)


def _instead(context: SearchContext, found: Explanation) -> Explanation | None:
    """The next explanation that is as good and whose numbers are determined."""
    best = found.rounds[0][0]
    others = tuple(candidate for candidate in found.rounds[0] if candidate.newest != best.newest)
    as_good = {candidate.newest: candidate for candidate in reversed(others) if both_stand(best, candidate)}
    for other in sorted(as_good.values(), key=lambda candidate: candidate.score.mean_log_error)[:REPLACEMENTS_TRIED]:
        rest = tuple(candidate for candidate in others if candidate is not other)
        instead = replace(found, after=context.confirmed(other), rounds=((other, *rest),), steps=(other,))
        if not any(_open(context, instead)):
            return instead
    return None


def _nothing(found: Explanation) -> Explanation:
    return replace(found, after=found.retuned, steps=())


def _open(context: SearchContext, found: Explanation) -> Iterator[bool]:
    """By effect: whether all its numbers that have a value meaning no effect are undetermined."""
    hypothesis, first = found.after.fitted.hypothesis, 0
    errors = number_errors(context, found)
    each = list(zip(hypothesis.numbers, hypothesis.point.tolist(), errors.tolist(), strict=True))
    for claim in hypothesis.claims:
        free = claim.groups * sum(not p.fixed for p in claim.effect.parameters)
        own = [number for number in each[first : first + free] if np.isfinite(number[0].parameter.none or 0.0)]
        first += free
        could_be_none = [(number, at, error) for number, at, error in own if number.parameter.none is not None]
        yield bool(could_be_none) and all(_is_open(*number) for number in could_be_none)


def _is_open(number: Number, at: float, error: float) -> bool:
    value, none = number.value(at), number.parameter.none or 0.0
    reach = 1.96 * INTERVAL_FACTOR * abs(number.value(at + error) - value)
    away = abs(value - none)
    return away <= _ABSENT * max(abs(value), abs(none)) or not reach <= UNDETERMINED_REACH * away
