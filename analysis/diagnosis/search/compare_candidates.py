"""Compare candidate hypotheses: continue the best first fits until they converge, then order all by their errors.

A Gauss-Newton fit converges about geometrically: after relative reductions g1 and g2 of the cost by two fits, the next
is expected to reduce it by g2 min(g2 / g1, 1) (`predict_decrease`); fits end when that is below a tolerance. A second
start and near equivalents of a hypothesis get a single fit (`_refine_until_converged`). The sensitivity (Jacobian) to
the model's own parameters takes one simulation for each of them. It is therefore kept from fit to fit, and recomputed
once after the first fit, then only where a parameter has moved far; only fits near the best are refined. With forces
that depend on the motion, a sensitivity that was computed without these forces, or on one period, may lead to a point
short of the minimum: refined fits are then continued with the sensitivity of all parameters on all samples (`_polish`).
"""

from collections.abc import Sequence
from dataclasses import replace
from functools import partial

import numpy as np

from analysis.diagnosis.errors.hypothesis import generate_near_equivalents, has_motion_forces
from analysis.diagnosis.errors.output_error import (
    Fitted,
    Sensitivity,
    build_jacobian,
    evaluate_fit,
    fit,
    predict_decrease,
    stack_fit_residuals,
)
from analysis.diagnosis.limits import (
    MOST_REFINED,
    NEAR_NOISE_ERROR,
    REFINING_GAIN_SHARE,
    RICHER_LAW_SQUARES,
    SAME_FIT_COST_SHARE,
    SECOND_START_ERROR,
    SHARED_SENSITIVITY_SHARE,
)
from analysis.diagnosis.search.search_context import FITTING, FittedCandidate, SearchContext, compute_sensitivity
from analysis.diagnosis.search.short_recordings import coarsen_steps, shorten_recordings
from analysis.diagnosis.search.time_budget import OutOfTimeError

REFINING_STEPS, FULL_FIT_STEPS = 4, 2
"""Gauss-Newton steps of a refining fit, and of one that continues it on all samples. Chosen."""
POLISHING_ROUNDS, POLISHING_GAIN = 3, 0.002
"""Largest number of rounds of `_polish`, and least share of the cost that a round must remove for another to follow
(or that of `_compute_gain_limit`, if it is larger). A round takes a simulation for every parameter of the model.
Chosen."""
MAX_RENEWALS, CONVERGED_GAIN, CONVERGED_GAIN_PER_LOG, RENEWAL_MOVE = 4, 0.0005, 0.01, 0.5
"""Largest number of fits in a row, with the sensitivity renewed between them; relative reduction of the cost below
which a fit has converged, and factor on ln(cost) for that limit far above the noise (`_compute_gain_limit`); and change
of a parameter, in standard deviations, above which the sensitivity is renewed. Chosen."""


def compare_candidates(context: SearchContext, base: Fitted, fits: Sequence[Fitted]) -> tuple[FittedCandidate, ...]:
    """Refine the best fits, and sort all candidates by their error. base: fit without the new effect. fits: first fits,
    the best first (`fit_first`); may be empty. If `base` contains a force that depends on the motion, the fits have
    been continued on all samples already, and are refined by `_polish` only."""
    promising = _select_promising(base, fits)
    is_continued = has_motion_forces(base.hypothesis)
    first_refined: list[tuple[Fitted, Sensitivity]] = []
    if not is_continued:
        refine_first = partial(refine_with_sensitivity, context)
        first_refined = list(context.guard.wrap(map, FITTING)(refine_first, promising[:1]))  # type: ignore[arg-type]
    refined = promising[:1] if is_continued else [fitted for fitted, _ in first_refined]

    def refit(fitted: Fitted) -> Fitted:
        if is_continued:
            return fitted
        is_similar = first_refined and _is_time_invariant(fitted) == _is_time_invariant(refined[0])
        is_similar = is_similar and _compute_prediction_difference(
            context, fitted, refined[0]
        ) < SHARED_SENSITIVITY_SHARE * (base.cost - refined[0].cost)
        return refine_with_sensitivity(context, fitted, first_refined[0][1] if is_similar else None)[0]

    further_fits = [
        fitted
        for rank, fitted in enumerate(promising[1:MOST_REFINED], 1)
        if not any(_is_same_start(context, fitted, rival) for rival in promising[:rank])
    ]
    if refined and context.score_fit(refined[0]).score.worst_channel <= SECOND_START_ERROR:
        further_fits = [
            fitted for fitted in further_fits if context.score_fit(fitted).score.worst_channel <= NEAR_NOISE_ERROR
        ]
    unrefined = [
        fitted for fitted in fits[1 if promising else 0 :] if not any(fitted is rival for rival in further_fits)
    ]
    special_cases = [special for special in unrefined if any(_contains(general, special) for general in refined[:1])][
        :1
    ]
    refined += context.guard.wrap(context.map_, FITTING)(refit, [*further_fits, *special_cases])  # type: ignore[arg-type]
    refined = _polish(context, sorted(refined, key=lambda fitted: context.score_fit(fitted).score.mean_log_error))
    fitted_candidates = [
        context.score_fit(fitted)
        for fitted in [*refined, *(skipped for skipped in unrefined if skipped not in special_cases)]
    ]
    return tuple(sorted(fitted_candidates, key=lambda candidate: candidate.score.mean_log_error))


def _polish(context: SearchContext, fits: list[Fitted]) -> list[Fitted]:
    """Continue the fits (the best first; may be empty) with the sensitivity of all parameters under the forces of the
    best; unchanged without forces that depend on the motion. Rounds follow while they lower the cost enough
    (`POLISHING_GAIN`). Where the best reaches the noise, fits far above it are not continued."""
    measure, tuning = context.measure, context.tuning
    if not any(has_motion_forces(fitted.hypothesis) for fitted in fits):
        return fits
    if _compute_worst_error(context, fits[0]) <= SECOND_START_ERROR and any(
        _compute_worst_error(context, fitted) > NEAR_NOISE_ERROR for fitted in fits
    ):
        close_fits = [fitted for fitted in fits if _compute_worst_error(context, fitted) <= NEAR_NOISE_ERROR]
        return sorted(
            [*_polish(context, close_fits), *(fitted for fitted in fits if fitted not in close_fits)],
            key=lambda fitted: fitted.cost,
        )
    for _ in range(POLISHING_ROUNDS):
        try:
            jacobian = build_jacobian(measure, tuning, fits[0].deviations, fits[0].hypothesis, context.map_)

            def continue_fit(fitted: Fitted, jacobian: Sensitivity = jacobian) -> Fitted:
                continue_candidate = partial(fit, measure, tuning, fitted, jacobian, FULL_FIT_STEPS, context.map_)
                return context.guard.run(fitted.hypothesis.claims[-1].effect.name, FITTING, continue_candidate, fitted)

            previous_cost, fits = fits[0].cost, list(context.map_(continue_fit, fits))  # type: ignore[arg-type]
        except OutOfTimeError:
            break  # the fits so far are valid results
        if fits[0].cost > previous_cost * (1 - max(POLISHING_GAIN, _compute_gain_limit(fits[0]))):
            break
    return fits


def _compute_worst_error(context: SearchContext, fitted: Fitted) -> float:
    """Compute the rms error of the worst channel, in units of the noise."""
    return context.score_fit(fitted).score.worst_channel


def _is_time_invariant(fitted: Fitted) -> bool:
    """Whether no effect of the fit depends on time within the recording (`Effect.of_time`)."""
    return not any(placed_effect.effect.of_time for placed_effect in fitted.hypothesis.list_placed_effects())


def _is_same_start(context: SearchContext, fitted: Fitted, compared_fit: Fitted) -> bool:
    """Whether two starts of the same hypothesis have converged to the same fit."""
    return (
        fitted.hypothesis.key == compared_fit.hypothesis.key
        and _compute_prediction_difference(context, fitted, compared_fit) < SAME_FIT_COST_SHARE * fitted.cost
    )


def _compute_prediction_difference(context: SearchContext, fitted: Fitted, compared_fit: Fitted) -> float:
    """Compute the mean square difference of two fits' predictions on the samples to fit, in units of the noise
    variance; infinite or NaN where a simulation diverged."""
    difference = stack_fit_residuals(context.measure, fitted.residuals) - stack_fit_residuals(
        context.measure, compared_fit.residuals
    )
    with np.errstate(over="ignore", invalid="ignore"):
        return float(difference @ difference) / max(len(difference), 1)


def _select_promising(base: Fitted, fits: Sequence[Fitted]) -> list[Fitted]:
    """Select the fits whose reduction of the cost of `base` is at least `REFINING_GAIN_SHARE` of that by the best fit;
    none where that is not positive. fits: the best first."""
    gains = [base.cost - fitted.cost for fitted in fits]
    return [fitted for fitted, gain in zip(fits, gains, strict=True) if gain >= REFINING_GAIN_SHARE * gains[0] > 0]


def refine(context: SearchContext, fitted: Fitted) -> Fitted:
    """Continue a fit until it converges, or the limits of rounds (`MAX_RENEWALS`, `POLISHING_ROUNDS`) are reached."""
    return _polish(context, [refine_with_sensitivity(context, fitted)[0]])[0]


def refine_with_sensitivity(
    context: SearchContext, fitted: Fitted, jacobian: Sensitivity | None = None
) -> tuple[Fitted, Sensitivity]:
    """Refine a fit; returns it with its sensitivity. Where the excitation is periodic, the fit is first made on one
    period of each segment, whose sensitivity is used for all periods; else, with forces that depend on the motion,
    first with longer simulation steps (`coarsen_steps`). jacobian: sensitivity of a hypothesis with nearly the same
    predicted motion; None = to be computed."""
    short_form = shorten_recordings(context, fitted)
    coarse_measure = coarsen_steps(context.measure)
    if short_form is None and (coarse_measure is context.measure or not has_motion_forces(fitted.hypothesis)):
        return _refine_from_both_starts(context, fitted, jacobian)
    short_context = replace(context, measure=coarse_measure) if short_form is None else short_form.context
    short_fit, jacobian = _refine_from_both_starts(
        short_context,
        evaluate_fit(short_context.measure, context.tuning, fitted.deviations, fitted.hypothesis),
        jacobian,
    )
    start = evaluate_fit(context.measure, context.tuning, short_fit.deviations, short_fit.hypothesis)
    full_fit = _fit_full_record(
        context, start, jacobian if short_form is None else short_form.repeat_sensitivity(jacobian)
    )
    # Parameters that one period does not determine may diverge on all samples: then start again from the given fit, or,
    # with forces that depend on the motion, keep it.
    if full_fit.cost <= fitted.cost:
        return choose_plainest(context, full_fit), jacobian
    return (fitted if has_motion_forces(fitted.hypothesis) else _refine_from_both_starts(context, fitted)[0]), jacobian


def _fit_full_record(context: SearchContext, start: Fitted, jacobian: Sensitivity) -> Fitted:
    """Fit to all samples, started from the fit to one period of each segment, or that with longer simulation steps:
    repeat fits of `FULL_FIT_STEPS` steps, at most `MAX_RENEWALS`, until the cost converges. The minimum may differ from
    that of one period, because periods may differ by more than the noise."""
    best_fit = start
    for _ in range(MAX_RENEWALS):
        next_fit = fit(context.measure, context.tuning, best_fit, jacobian, FULL_FIT_STEPS, context.map_)
        has_converged = next_fit.cost > best_fit.cost * (1 - _compute_gain_limit(next_fit))
        best_fit = next_fit
        if has_converged:
            break
    return best_fit


def _compute_gain_limit(fitted: Fitted) -> float:
    """Compute the relative reduction of the cost below which a fit has converged: max(CONVERGED_GAIN,
    CONVERGED_GAIN_PER_LOG ln(cost))."""
    return max(CONVERGED_GAIN, CONVERGED_GAIN_PER_LOG * float(np.log(max(fitted.cost, 1.0))))


def _refine_from_both_starts(
    context: SearchContext, fitted: Fitted, jacobian: Sensitivity | None = None
) -> tuple[Fitted, Sensitivity]:
    """Refine a fit from one or two starts; returns the better one with its sensitivity. Where the first leaves more
    than noise, a second starts from the calibrated model, because re-tuning may have absorbed the missing effect and
    ended in another minimum. There is no second start if `jacobian` is given: it was tried for the hypothesis of that
    sensitivity, whose predicted motion is nearly the same."""
    is_jacobian_shared = jacobian is not None
    # With 1 as the previous gain, `_refine_until_converged` may renew a shared sensitivity instead of ending after one
    # fit.
    first_fit, jacobian = _refine_until_converged(context, fitted, jacobian, 1.0)
    first_fit, jacobian = _refine_similar(context, first_fit, jacobian)
    if is_jacobian_shared or context.score_fit(first_fit).score.worst_channel <= SECOND_START_ERROR:
        return first_fit, jacobian
    calibrated_start = evaluate_fit(
        context.measure, context.tuning, np.zeros_like(first_fit.deviations), first_fit.hypothesis
    )
    second_fit, second_jacobian = _refine_until_converged(context, calibrated_start, jacobian)
    return (second_fit, second_jacobian) if second_fit.cost < first_fit.cost else (first_fit, jacobian)


def _refine_similar(context: SearchContext, fitted: Fitted, jacobian: Sensitivity) -> tuple[Fitted, Sensitivity]:
    """Find the best fit among similar hypotheses (`generate_near_equivalents`), or the plainest of them if it is about
    as good (`choose_plainest`), and the sensitivity of the best."""
    best_refined = fitted, jacobian
    for variant in generate_near_equivalents(fitted.hypothesis):
        refined_variant = _refine_until_converged(
            context, evaluate_fit(context.measure, context.tuning, fitted.deviations, variant), jacobian
        )
        best_refined = refined_variant if refined_variant[0].cost < best_refined[0].cost else best_refined
    return choose_plainest(context, best_refined[0]), best_refined[1]


def choose_plainest(context: SearchContext, fitted: Fitted) -> Fitted:
    """Choose the fit, or a similar form of its laws (`generate_near_equivalents`, in its order) whose sum of squares
    exceeds that of the form chosen so far by less than `RICHER_LAW_SQUARES` noise variances."""
    plainest = fitted
    for variant in generate_near_equivalents(fitted.hypothesis):
        variant_fit = evaluate_fit(context.measure, context.tuning, plainest.deviations, variant)
        sample_count = len(stack_fit_residuals(context.measure, variant_fit.residuals))
        plainest = variant_fit if variant_fit.cost < plainest.cost + RICHER_LAW_SQUARES / sample_count else plainest
    return plainest


def _refine_until_converged(
    context: SearchContext, fitted: Fitted, jacobian: Sensitivity | None, previous_gain: float = np.inf
) -> tuple[Fitted, Sensitivity]:
    """Continue a fit, with renewed sensitivities, until the cost converges or `MAX_RENEWALS` is reached. jacobian:
    sensitivity at another point of the same hypothesis, or of one with nearly the same predicted motion; None = not
    computed yet. previous_gain: relative reduction of the cost by the previous fit, of use only with a given
    `jacobian`; if it is infinite, no further reduction is expected after the first fit, which is then the only one."""
    best_fit = fitted
    is_recomputed_or_given = jacobian is not None
    previous_gain = previous_gain if is_recomputed_or_given else np.inf
    current_jacobian = jacobian or compute_sensitivity(context, best_fit.deviations, best_fit.hypothesis)
    for _ in range(MAX_RENEWALS):
        next_fit = fit(context.measure, context.tuning, best_fit, current_jacobian, REFINING_STEPS, context.map_)
        gain = 1 - next_fit.cost / best_fit.cost if best_fit.cost > 0 else 0.0
        best_fit, expected_gain, previous_gain = next_fit, predict_decrease(gain, previous_gain), gain
        has_converged = (expected_gain if is_recomputed_or_given else gain) < _compute_gain_limit(best_fit)
        if (is_recomputed_or_given and has_converged) or (
            context.score_fit(best_fit).score.worst_channel <= SECOND_START_ERROR and has_converged
        ):
            break
        if (
            not is_recomputed_or_given
            or np.abs(best_fit.deviations - current_jacobian.base_deviations).max(initial=0.0) > RENEWAL_MOVE
        ):
            current_jacobian = compute_sensitivity(context, best_fit.deviations, best_fit.hypothesis, with_forces=True)
            is_recomputed_or_given = True
    return best_fit, current_jacobian


def _contains(general_fit: Fitted, special_fit: Fitted) -> bool:
    """Whether the last effect of `general_fit` contains that of `special_fit` as a special case, at sites that include
    those of `special_fit`: for a fair comparison both must then be refined."""
    general_claim, special_claim = general_fit.hypothesis.claims[-1], special_fit.hypothesis.claims[-1]
    return special_claim.effect.name in general_claim.effect.simpler and set(special_claim.sites) <= set(
        general_claim.sites
    )
