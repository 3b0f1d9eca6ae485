"""Compares candidates: the best first fits are continued until they converge, then all are ordered by their errors.

A Gauss-Newton fit converges about geometrically: after relative reductions g1 and g2 of the cost by two fits, the next
is expected to reduce it by g2 min(g2 / g1, 1) (`output_error.expect_gain`); fits end when that is below a tolerance.
The sensitivity to the model's own parameters costs one simulation for each of them. It is therefore kept from fit to
fit, and recomputed only where a parameter has moved far. So all candidates are compared at a small part of the cost of
full fits, and only those near the best are refined. With forces that depend on the motion, a sensitivity that was
computed without these forces, or on one period, ends short of the minimum: refined fits are then continued with the
sensitivity of all parameters on all samples (`_polish`).
"""

from collections.abc import Sequence
from dataclasses import replace
from functools import partial

import numpy as np

from analysis.diagnosis.errors.hypothesis import has_motion_forces, similar_hypotheses
from analysis.diagnosis.errors.output_error import (
    Fitted,
    Sensitivity,
    evaluate_fit,
    expect_gain,
    fit,
    residuals_to_fit,
    sensitivity,
)
from analysis.diagnosis.search.search_context import FITTING, FittedCandidate, SearchContext, sensitivity_at
from analysis.diagnosis.search.short_recordings import coarsen, short_recordings_of
from analysis.diagnosis.search.time_budget import OutOfTimeError
from analysis.diagnosis.settings import (
    MOST_REFINED,
    NO_SECOND_START,
    REACHES_NOISE,
    RICHER_LAW_SQUARES,
    SAME_START,
    SHARED_MOTION,
    WORTH_REFINING,
)

SECOND_ROUNDS, WHOLE_ROUNDS = 4, 2
"""Gauss-Newton steps of a refining fit, and of a fit to all periods."""
MOST_POLISHED, POLISHED = 3, 0.002
"""Largest number of rounds of `_polish`, and share of the cost that a round must remove for another to follow. A round
takes a simulation for every parameter of the model. By hand."""
MOST_REFRESHED, CONVERGED, CONVERGED_FAR, STALE = 4, 0.0005, 0.01, 0.5
"""Largest number of fits in a row, with the sensitivity renewed between them; share of the cost below which a reduction
is none, and factor on ln(cost) for that share far above the noise (`_least_gain`); and move of a parameter, in standard
deviations, from which the sensitivity is renewed, which costs a simulation per parameter."""


def compare_candidates(context: SearchContext, base: Fitted, fits: Sequence[Fitted]) -> tuple[FittedCandidate, ...]:
    """The candidates sorted by error, the best fits refined. fits: first fits, the best first (`first_fits`)."""
    worth = _worth_refining(base, fits)
    # Where a held effect is a force that depends on the motion, first fits were continued on all samples already.
    continued = has_motion_forces(base.hypothesis)
    first: list[tuple[Fitted, Sensitivity]] = []
    if not continued:
        refine_first = partial(refine_with_sensitivity, context)
        first = list(context.guard.over(map, FITTING)(refine_first, worth[:1]))  # type: ignore[arg-type]
    refined = worth[:1] if continued else [law for law, _ in first]

    def refit(law: Fitted) -> Fitted:
        if continued:
            return law
        near = first and _is_timeless(law) == _is_timeless(refined[0])
        near = near and _prediction_difference(context, law, refined[0]) < SHARED_MOTION * (base.cost - refined[0].cost)
        return refine_with_sensitivity(context, law, first[0][1] if near else None)[0]

    others = [
        law
        for number, law in enumerate(worth[1:MOST_REFINED], 1)
        if not any(_is_same_start(context, law, other) for other in worth[:number])
    ]
    if refined and context.candidate(refined[0]).score.worst_channel <= NO_SECOND_START:
        others = [law for law in others if context.candidate(law).score.worst_channel <= REACHES_NOISE]
    rest = [law for law in fits[1 if worth else 0 :] if not any(law is other for other in others)]
    plain = [plain_law for plain_law in rest if any(_contains(richer, plain_law) for richer in refined[:1])][:1]
    refined += context.guard.over(context.map_, FITTING)(refit, [*others, *plain])  # type: ignore[arg-type]
    refined = _polish(context, sorted(refined, key=lambda law: context.candidate(law).score.mean_log_error))
    fitted_candidates = [context.candidate(law) for law in [*refined, *(law for law in rest if law not in plain)]]
    return tuple(sorted(fitted_candidates, key=lambda candidate: candidate.score.mean_log_error))


def _polish(context: SearchContext, fits: list[Fitted]) -> list[Fitted]:
    """The fits, the best first, continued with the sensitivity of all parameters under the forces of the best;
    unchanged without forces that depend on the motion. Rounds follow while they lower the cost, even at the noise: such
    a fit may be two standard deviations off. Where the best reaches the noise, fits far above it are not continued."""
    measure, tuning = context.measure, context.tuning
    if not any(has_motion_forces(law.hypothesis) for law in fits):
        return fits
    if _error_of(context, fits[0]) <= NO_SECOND_START and any(_error_of(context, law) > REACHES_NOISE for law in fits):
        near = [law for law in fits if _error_of(context, law) <= REACHES_NOISE]
        return sorted([*_polish(context, near), *(law for law in fits if law not in near)], key=lambda law: law.cost)
    for _ in range(MOST_POLISHED):
        try:
            known = sensitivity(measure, tuning, fits[0].deviations, fits[0].hypothesis, context.map_)

            def continue_fit(law: Fitted, known: Sensitivity = known) -> Fitted:
                further = partial(fit, measure, tuning, law, known, WHOLE_ROUNDS, context.map_)
                return context.guard.part(law.hypothesis.claims[-1].effect.name, FITTING, further, law)

            before, fits = fits[0].cost, list(context.map_(continue_fit, fits))  # type: ignore[arg-type]
        except OutOfTimeError:
            break  # the fits so far are valid results
        if fits[0].cost > before * (1 - max(POLISHED, _least_gain(fits[0]))):
            break
    return fits


def _error_of(context: SearchContext, law: Fitted) -> float:
    """Error of the worst channel, in units of the noise."""
    return context.candidate(law).score.worst_channel


def _is_timeless(law: Fitted) -> bool:
    """Whether no effect of the fit depends on time within the recording (`Effect.of_time`)."""
    return not any(placed.effect.of_time for placed in law.hypothesis.list_placed_effects())


def _is_same_start(context: SearchContext, law: Fitted, other: Fitted) -> bool:
    """Whether two starts of the same hypothesis have converged to the same fit."""
    return (
        law.hypothesis.key == other.hypothesis.key
        and _prediction_difference(context, law, other) < SAME_START * law.cost
    )


def _prediction_difference(context: SearchContext, law: Fitted, other: Fitted) -> float:
    """Mean square difference of two fits' predictions on the samples to fit, in units of the noise's variance."""
    apart = residuals_to_fit(context.measure, law.residuals) - residuals_to_fit(context.measure, other.residuals)
    with np.errstate(over="ignore", invalid="ignore"):
        return float(apart @ apart) / max(len(apart), 1)


def _worth_refining(base: Fitted, fits: Sequence[Fitted]) -> list[Fitted]:
    """The fits that lower the cost of `base` by at least `WORTH_REFINING` of what the best fit does. fits: the best
    first."""
    gained = [base.cost - found.cost for found in fits]
    return [found for found, gain in zip(fits, gained, strict=True) if gain >= WORTH_REFINING * gained[0] > 0]


def refine(context: SearchContext, fitted: Fitted) -> Fitted:
    """The fit continued until it converges."""
    return _polish(context, [refine_with_sensitivity(context, fitted)[0]])[0]


def refine_with_sensitivity(
    context: SearchContext, fitted: Fitted, known: Sensitivity | None = None
) -> tuple[Fitted, Sensitivity]:
    """The refined fit and its sensitivity. Where a drive repeats, the fit is first made on one period of each segment,
    and its sensitivity serves for all periods; else, with forces that depend on the motion, first with longer
    simulation steps (`coarsen`). known: sensitivity of a law that moves the device nearly alike."""
    short_form = short_recordings_of(context, fitted)
    coarse = coarsen(context.measure)
    if short_form is None and (coarse is context.measure or not has_motion_forces(fitted.hypothesis)):
        return _refine_from_both_starts(context, fitted, known)
    near_context = replace(context, measure=coarse) if short_form is None else short_form.context
    near, known = _refine_from_both_starts(
        near_context, evaluate_fit(near_context.measure, context.tuning, fitted.deviations, fitted.hypothesis), known
    )
    start = evaluate_fit(context.measure, context.tuning, near.deviations, near.hypothesis)
    found = _fit_whole(context, start, known if short_form is None else short_form.repeat_sensitivity(known))
    # Parameters that one period does not determine may diverge on all samples: then the fit before is kept.
    if found.cost <= fitted.cost:
        return choose_plainest(context, found), known
    return (fitted if has_motion_forces(fitted.hypothesis) else _refine_from_both_starts(context, fitted)[0]), known


def _fit_whole(context: SearchContext, start: Fitted, known: Sensitivity) -> Fitted:
    """The fit to all periods, started from the fit to one period of each segment: a few steps are usually enough, more
    where the error is above the noise, because periods may then differ."""
    best = start
    for _ in range(MOST_REFRESHED):
        better = fit(context.measure, context.tuning, best, known, WHOLE_ROUNDS, context.map_)
        settled = better.cost > best.cost * (1 - _least_gain(better))
        best = better
        if settled:
            break
    return best


def _least_gain(fitted: Fitted) -> float:
    """Relative reduction of the cost below which a fit has converged: max(CONVERGED, CONVERGED_FAR ln(cost))."""
    return max(CONVERGED, CONVERGED_FAR * float(np.log(max(fitted.cost, 1.0))))


def _refine_from_both_starts(
    context: SearchContext, fitted: Fitted, known: Sensitivity | None = None
) -> tuple[Fitted, Sensitivity]:
    """The better of two refined fits, with its sensitivity. Where the first leaves more than noise, a second starts
    from the calibrated model, because re-tuning may have absorbed the missing effect and ended in another minimum. With
    a known sensitivity there is no second start: the law it belongs to, which moves the device nearly alike, had it."""
    shared = known is not None
    # With 1 as the reduction before, `_refine_from` may renew a shared sensitivity instead of ending after one fit.
    here, known = _refine_from(context, fitted, known, 1.0)
    here, known = _refine_similar(context, here, known)
    if shared or context.candidate(here).score.worst_channel <= NO_SECOND_START:
        return here, known
    calibrated = evaluate_fit(context.measure, context.tuning, np.zeros_like(here.deviations), here.hypothesis)
    there, beside = _refine_from(context, calibrated, known)
    return (there, beside) if there.cost < here.cost else (here, known)


def _refine_similar(context: SearchContext, fitted: Fitted, known: Sensitivity) -> tuple[Fitted, Sensitivity]:
    """The best fit among similar hypotheses (`similar_hypotheses`), or the plainest of them if it is about as good, and
    the sensitivity there."""
    best = fitted, known
    for other in similar_hypotheses(fitted.hypothesis):
        beside = _refine_from(context, evaluate_fit(context.measure, context.tuning, fitted.deviations, other), known)
        best = beside if beside[0].cost < best[0].cost else best
    return choose_plainest(context, best[0]), best[1]


def choose_plainest(context: SearchContext, fitted: Fitted) -> Fitted:
    """The fit, or a similar form of its laws (`similar_hypotheses`) whose sum of squares exceeds that of the form
    preferred so far by less than `RICHER_LAW_SQUARES` noise variances."""
    best = fitted
    for other in similar_hypotheses(fitted.hypothesis):
        plain = evaluate_fit(context.measure, context.tuning, best.deviations, other)
        samples = len(residuals_to_fit(context.measure, plain.residuals))
        best = plain if plain.cost < best.cost + RICHER_LAW_SQUARES / samples else best
    return best


def _refine_from(
    context: SearchContext, fitted: Fitted, known: Sensitivity | None, before: float = np.inf
) -> tuple[Fitted, Sensitivity]:
    """The fit continued with renewed sensitivities until the cost hardly falls. known: sensitivity at another point of
    the same hypothesis, or of a hypothesis that moves the device nearly alike; None = not computed yet. before:
    relative reduction of the cost by the fit before; infinite = unknown, no further reduction is expected."""
    best = fitted
    complete = known is not None
    before = before if complete else np.inf
    there = known or sensitivity_at(context, best.deviations, best.hypothesis)
    for _ in range(MOST_REFRESHED):
        better = fit(context.measure, context.tuning, best, there, SECOND_ROUNDS, context.map_)
        gained = 1 - better.cost / best.cost if best.cost > 0 else 0.0
        best, expected, before = better, expect_gain(gained, before), gained
        settled = (expected if complete else gained) < _least_gain(best)
        if (complete and settled) or (context.candidate(best).score.worst_channel <= NO_SECOND_START and settled):
            break
        if not complete or np.abs(best.deviations - there.at).max(initial=0.0) > STALE:
            there = sensitivity_at(context, best.deviations, best.hypothesis, with_forces=True)
            complete = True
    return best, there


def _contains(richer: Fitted, plain: Fitted) -> bool:
    """Whether the last effect of `richer` contains that of `plain` as a special case at the same sites: for a fair
    comparison both must then be fitted equally far."""
    last, other = richer.hypothesis.claims[-1], plain.hypothesis.claims[-1]
    return other.effect.name in last.effect.simpler and set(other.sites) <= set(last.sites)
