"""Compares candidates: the best first fits are continued until they converge, then ordered by their errors.

A Gauss-Newton fit converges about geometrically: after gains g1 and g2 of two steps the next one is predicted to gain
g2 min(g2 / g1, 1). A fit ends when that is below a tolerance (`output_error.expect_gain`). The sensitivity to the
model's own parameters costs one simulation each; it is kept from fit to fit, and recomputed only where a parameter has
moved far from where it was computed. So all candidates can be compared at a small part of the cost of full fits, and
only those within reach of the best are refined. Under forces that depend on the motion, a sensitivity without these, or
of one period, ends short of the minimum: what is refined is polished with that of all parameters on all samples.
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
MOST_POLISHED, POLISHED = 3, 0.002
"""Times at most that fits are polished, and share of the cost that must be gained to go on; each takes a simulation for
every parameter of the model. By hand."""
MOST_REFRESHED, CONVERGED, CONVERGED_FAR, STALE = 4, 0.0005, 0.01, 0.5
"""The sensitivity to the model's parameters is recomputed so often, or until that gains no more than such a share, or,
far above the noise, such a share of the logarithm of the error; and only where one of the parameters has moved by so
many standard deviations since, for it costs a simulation for each."""


def compare_candidates(context: SearchContext, base: Fitted, fits: Sequence[Fitted]) -> tuple[FittedCandidate, ...]:
    """The candidates sorted by error, the best fits refined. fits: first fits, the best first (`first_fits`)."""
    worth = _worth_refining(base, fits)
    # First fits beside a force that depends on the motion have been continued on all samples already.
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
    """The fits continued with the sensitivity of all parameters under the forces of the first, which they share, and
    again while that gains, at noise too: a fit that leaves hardly more may still be two standard deviations off. fits:
    of laws that do nearly the same, the best first; where that leaves noise alone, those that leave much more are given
    up. Without such forces they are complete."""
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
            break  # fits that are not polished are results all the same
        if fits[0].cost > before * (1 - max(POLISHED, _least_gain(fits[0]))):
            break
    return fits


def _error_of(context: SearchContext, law: Fitted) -> float:
    """Error of the worst channel, times the noise."""
    return context.candidate(law).score.worst_channel


def _is_timeless(law: Fitted) -> bool:
    return not any(placed.effect.of_time for placed in law.hypothesis.list_placed_effects())


def _is_same_start(context: SearchContext, law: Fitted, other: Fitted) -> bool:
    """Whether two starts of the same hypothesis have converged to the same fit."""
    return (
        law.hypothesis.key == other.hypothesis.key
        and _prediction_difference(context, law, other) < SAME_START * law.cost
    )


def _prediction_difference(context: SearchContext, law: Fitted, other: Fitted) -> float:
    """Mean square difference of two fits' predictions, in units of the noise."""
    apart = residuals_to_fit(context.measure, law.residuals) - residuals_to_fit(context.measure, other.residuals)
    with np.errstate(over="ignore", invalid="ignore"):
        return float(apart @ apart) / max(len(apart), 1)


def _worth_refining(base: Fitted, fits: Sequence[Fitted]) -> list[Fitted]:
    """The fits whose gain is not far below the best one's. fits: the best first."""
    gained = [base.cost - found.cost for found in fits]
    return [found for found, gain in zip(fits, gained, strict=True) if gain >= WORTH_REFINING * gained[0] > 0]


def refine(context: SearchContext, fitted: Fitted) -> Fitted:
    """The fit continued until it converges."""
    return _polish(context, [refine_with_sensitivity(context, fitted)[0]])[0]


def refine_with_sensitivity(
    context: SearchContext, fitted: Fitted, known: Sensitivity | None = None
) -> tuple[Fitted, Sensitivity]:
    """The refined fit and its sensitivity. Where a drive repeats, it is first fitted to one period of each segment,
    whose sensitivity then stands for all periods; where it does not, under forces that depend on the motion, with
    longer steps. known: the sensitivity of a law that moves the device nearly alike."""
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
    # What one period leaves open may run away on the whole.
    if found.cost <= fitted.cost:
        return choose_plainest(context, found), known
    return (fitted if has_motion_forces(fitted.hypothesis) else _refine_from_both_starts(context, fitted)[0]), known


def _fit_whole(context: SearchContext, start: Fitted, known: Sensitivity) -> Fitted:
    """The fit to all periods, from that to one of them: mostly settled after a few steps, but where more than noise is
    left, the periods may differ, and the fit moves on."""
    best = start
    for _ in range(MOST_REFRESHED):
        better = fit(context.measure, context.tuning, best, known, WHOLE_ROUNDS, context.map_)
        settled = better.cost > best.cost * (1 - _least_gain(better))
        best = better
        if settled:
            break
    return best


def _least_gain(fitted: Fitted) -> float:
    """Share of the cost below which a further gain counts as none; far above the noise it is larger."""
    return max(CONVERGED, CONVERGED_FAR * float(np.log(max(fitted.cost, 1.0))))


def _refine_from_both_starts(
    context: SearchContext, fitted: Fitted, known: Sensitivity | None = None
) -> tuple[Fitted, Sensitivity]:
    """The refined fit and its sensitivity; where more than noise is left, also started from the calibrated model,
    because re-tuning may have absorbed the missing effect and ended in another minimum. Not where a sensitivity is
    known: the law that it is of was started from there, and moves the device nearly alike."""
    shared = known is not None
    # A gain of all that there is counts as the one before: what is shared may have to be computed anew.
    here, known = _refine_from(context, fitted, known, 1.0)
    here, known = _refine_similar(context, here, known)
    if shared or context.candidate(here).score.worst_channel <= NO_SECOND_START:
        return here, known
    calibrated = evaluate_fit(context.measure, context.tuning, np.zeros_like(here.deviations), here.hypothesis)
    there, beside = _refine_from(context, calibrated, known)
    return (there, beside) if there.cost < here.cost else (here, known)


def _refine_similar(context: SearchContext, fitted: Fitted, known: Sensitivity) -> tuple[Fitted, Sensitivity]:
    """The best fit among similar hypotheses; the plainest where it is as good as any."""
    best = fitted, known
    for other in similar_hypotheses(fitted.hypothesis):
        beside = _refine_from(context, evaluate_fit(context.measure, context.tuning, fitted.deviations, other), known)
        best = beside if beside[0].cost < best[0].cost else best
    return choose_plainest(context, best[0]), best[1]


def choose_plainest(context: SearchContext, fitted: Fitted) -> Fitted:
    """The plainest of the similar forms of the fit's laws that leaves hardly more than the best of them."""
    best = fitted
    for other in similar_hypotheses(fitted.hypothesis):
        plain = evaluate_fit(context.measure, context.tuning, best.deviations, other)
        samples = len(residuals_to_fit(context.measure, plain.residuals))
        best = plain if plain.cost < best.cost + RICHER_LAW_SQUARES / samples else best
    return best


def _refine_from(
    context: SearchContext, fitted: Fitted, known: Sensitivity | None, before: float = np.inf
) -> tuple[Fitted, Sensitivity]:
    """Fits with the sensitivity recomputed until that gains little. known: sensitivity at another point of the same
    hypothesis, or of one that moves the device nearly alike; None = not computed yet. before: share that was gained
    last; infinite = one fit is enough once the sensitivity is computed."""
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
    """Whether the last claim contains the other's as a special case: then both must be fitted equally well."""
    last, other = richer.hypothesis.claims[-1], plain.hypothesis.claims[-1]
    return other.effect.name in last.effect.simpler and set(other.sites) <= set(last.sites)
