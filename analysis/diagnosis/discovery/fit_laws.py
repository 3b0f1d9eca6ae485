"""Fits sums of terms as laws by output error, and puts the simplest of those that fit about equally well first.

Screening uses a linearised residual (`fit_sum`); here, each sum is simulated with the model, and all parameters are
fitted together by Gauss-Newton steps (`errors.output_error`). Called by `discover`.
"""

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import cache, partial
from itertools import product
from typing import TypeVar

import numpy as np

from analysis.diagnosis.discovery.antisymmetric_pairs import (
    convert_to_pair,
    is_coupling,
    list_pair_starts,
    sum_squared_coupling_deviations,
)
from analysis.diagnosis.discovery.convert_sum import convert_sum_to_hypothesis, list_fitted_laws
from analysis.diagnosis.discovery.fit_sum import Sum
from analysis.diagnosis.discovery.snap_exponents import is_full_soft_limit
from analysis.diagnosis.errors.hypothesis import combine_hypotheses
from analysis.diagnosis.errors.output_error import Fitted, evaluate_fit, fit
from analysis.diagnosis.limits import LAW_EXPONENT_TOLERANCE
from analysis.diagnosis.search.compare_candidates import refine
from analysis.diagnosis.search.parsimony import are_inseparable
from analysis.diagnosis.search.search_context import (
    FIRST_FIT_STEPS,
    FittedCandidate,
    SearchContext,
    compute_sensitivity,
)
from analysis.diagnosis.search.short_recordings import coarsen_steps, shorten_recordings
from analysis.diagnosis.search.time_budget import OutOfTimeError
from analysis.diagnosis.types import TimeBudget
from equalizer.plant.mechanical_model import MechanicalModelError

T = TypeVar("T")
"""Type of the result in `run_within_time`."""


def fit_sums(
    context: SearchContext, base: Fitted, sums: Sequence[Sum], time_left: TimeBudget
) -> tuple[tuple[FittedCandidate, Sum], ...]:
    """Fit sums by output error, added to the hypothesis of `base`. The best sum, and then simpler sums that are
    inseparable from it, are fitted to convergence and returned first, the others for a few steps. When the time ends,
    returns those begun by then; empty where none can be fitted."""
    fit_few_steps = _make_first_fitter(context, base)
    first_fits = [
        (run_within_time(partial(fit_few_steps, starting_fit), starting_fit), term_sum)
        for term_sum in sums
        if time_left()
        for starting_fit in _make_starting_fits(context, base, term_sum)
    ]
    first_fits.sort(key=lambda fit_and_sum: fit_and_sum[0].cost)
    if not first_fits or not np.isfinite(first_fits[0][0].cost):
        return ()
    best_fit = first_fits[0]
    # Of the starts of a law, that with the lower cost may converge to the fit of the re-tuned model without the law.
    converged_fits = [
        _refine(context, starting_fit)
        for starting_fit, term_sum in first_fits
        if term_sum is best_fit[1] and np.isfinite(starting_fit.cost)
    ]
    refined = [(context.score_fit(min(converged_fits, key=lambda converged_fit: converged_fit.cost)), best_fit[1])]
    other_fits = {
        id(term_sum): (starting_fit, term_sum)
        for starting_fit, term_sum in reversed(first_fits)
        if term_sum is not best_fit[1]
    }
    other_candidates = [
        (context.score_fit(_convert_to_pair(context, best_fit, refined[0][0], fit_and_sum)), fit_and_sum[1])
        for fit_and_sum in sorted(other_fits.values(), key=lambda fit_and_sum: fit_and_sum[0].cost)
    ]
    simpler_laws = [
        fit_and_sum
        for fit_and_sum in other_candidates
        if time_left()
        and _count_parameters(fit_and_sum) < _count_parameters(refined[0])
        and are_inseparable(refined[0][0], fit_and_sum[0])
    ]
    refined += [(context.score_fit(_refine(context, candidate.fitted)), law_sum) for candidate, law_sum in simpler_laws]
    return (*refined, *(fit_and_sum for fit_and_sum in other_candidates if fit_and_sum not in simpler_laws))


def _make_first_fitter(context: SearchContext, base: Fitted) -> Callable[[Fitted], Fitted]:
    """Make the function that fits a starting fit for `FIRST_FIT_STEPS` steps. Where the drive repeats and the law does
    not depend on time, it fits to one period of each segment with longer simulation steps (`short_recordings`), which
    suffices for a ranking, and returns the fit or the start, whichever has the lower cost on all samples."""
    tuning, shortened = context.tuning, shorten_recordings(context, base)
    compute_sensitivity_to_model = cache(
        lambda search_context: compute_sensitivity(search_context, base.deviations, base.hypothesis)
    )
    short_context = None
    if shortened is not None:
        short_context = replace(shortened.context, measure=coarsen_steps(shortened.context.measure))

    def fit_few_steps(starting_fit: Fitted) -> Fitted:
        depends_on_time = any(effect.effect.of_time for effect in starting_fit.hypothesis.list_placed_effects())
        if short_context is None or depends_on_time:
            sensitivity = compute_sensitivity_to_model(context)
            return fit(context.measure, tuning, starting_fit, sensitivity, FIRST_FIT_STEPS, context.map_)
        sensitivity = compute_sensitivity_to_model(short_context)
        short_start = evaluate_fit(short_context.measure, tuning, starting_fit.deviations, starting_fit.hypothesis)
        short_fit = fit(short_context.measure, tuning, short_start, sensitivity, FIRST_FIT_STEPS, context.map_)
        fit_on_all_samples = evaluate_fit(context.measure, tuning, short_fit.deviations, short_fit.hypothesis)
        return min(fit_on_all_samples, starting_fit, key=lambda candidate: candidate.cost)

    return fit_few_steps


def _make_starting_fits(context: SearchContext, base: Fitted, term_sum: Sum) -> list[Fitted]:
    """Add the sum to the base fit, with the model's own parameters unchanged or shifted as in the fit of the sum: the
    start with the lower cost. Where re-tuning without this law ended at a bound, also a start with the calibrated
    parameters. Starts that make no model are left out."""
    recording = context.measure.records[0].recording
    bound = context.tuning.bound
    shifted_deviations = np.clip(base.deviations + term_sum.model_shift, -bound, bound)
    calibrated_deviations = np.zeros_like(base.deviations)
    is_at_bound = context.tuning.is_at_bound(base.deviations)
    starting_sums = (term_sum,) if term_sum.partner is None else list_pair_starts(term_sum)
    chosen_fits: list[Fitted] = []
    for deviation_sets in ((base.deviations, shifted_deviations), *([(calibrated_deviations,)] if is_at_bound else [])):
        trial_fits: list[Fitted] = []
        for starting_sum, deviations in product(starting_sums, deviation_sets):
            hypothesis = combine_hypotheses(base.hypothesis, convert_sum_to_hypothesis(starting_sum, recording))
            try:
                trial_fits.append(evaluate_fit(context.measure, context.tuning, deviations, hypothesis))
            except (MechanicalModelError, np.linalg.LinAlgError):
                continue
        chosen_fits += [min(trial_fits, key=lambda trial_fit: trial_fit.cost)] if trial_fits else []
    return chosen_fits


def _convert_to_pair(
    context: SearchContext, best_fit: tuple[Fitted, Sum], refined_best: FittedCandidate, other_fit: tuple[Fitted, Sum]
) -> Fitted:
    """Convert the refined best fit to the pair of the other fit, if that is a pair and the best sum may be a half of
    it; else, or where that fails, return the other fit."""
    best_sum, other_sum = best_fit[1], other_fit[1]
    if best_sum.partner is not None or other_sum.partner is None or not is_coupling(best_sum):
        return other_fit[0]
    return convert_to_pair(context.measure, context.tuning, (refined_best.fitted, best_sum), other_sum) or other_fit[0]


def put_simplest_first(
    context: SearchContext, fits_and_sums: Sequence[tuple[FittedCandidate, Sum]]
) -> list[tuple[FittedCandidate, Sum]]:
    """Sort the candidates by rising error and move the preferred one to the front: among those inseparable from the
    best, the one with the fewest parameters; if it is a force linear in another axis's motion, among equally simple
    ones that with the smallest change of the model's own coupled parameters. fits_and_sums: at least one."""
    ranked_fits = sorted(fits_and_sums, key=lambda fit_and_sum: fit_and_sum[0].score.mean_log_error)
    inseparable_fits = [
        fit_and_sum for fit_and_sum in ranked_fits if are_inseparable(ranked_fits[0][0], fit_and_sum[0])
    ]
    preferred_fit = min(inseparable_fits, key=_count_parameters)
    if is_coupling(preferred_fit[1]):
        equally_simple_fits = [
            fit_and_sum
            for fit_and_sum in inseparable_fits
            if is_coupling(fit_and_sum[1]) and _count_parameters(fit_and_sum) == _count_parameters(preferred_fit)
        ]
        preferred_fit = min(
            equally_simple_fits,
            key=lambda fit_and_sum: sum_squared_coupling_deviations(context.tuning, fit_and_sum[0].fitted),
        )
    return [preferred_fit, *(fit_and_sum for fit_and_sum in ranked_fits if fit_and_sum is not preferred_fit)]


def _count_parameters(fit_and_sum: tuple[FittedCandidate, Sum]) -> int:
    """Count the free parameters of a sum. Exponents within `LAW_EXPONENT_TOLERANCE` of whole or half numbers are not
    counted, nor is the factor of a soft limit that is 1."""
    candidate, term_sum = fit_and_sum
    law = list_fitted_laws(candidate.fitted.hypothesis)[-1]
    count = 0 if law is None else -int(is_full_soft_limit(law, LAW_EXPONENT_TOLERANCE))
    for term in term_sum.terms:
        simple_exponents = [
            k
            for k in term.exponents
            if abs(2 * term.numbers[k] - round(2 * term.numbers[k])) < 2 * LAW_EXPONENT_TOLERANCE
        ]
        count += 1 + len(term.numbers) - len(simple_exponents)
    return count


def _refine(context: SearchContext, starting_fit: Fitted) -> Fitted:
    """Continue a fit to convergence; returns its start where the time ends before."""
    return run_within_time(lambda: refine(context, starting_fit), starting_fit)


def run_within_time(compute: Callable[[], T], fallback: T) -> T:
    """Return the result of `compute`, or `fallback` where the time ends during it (OutOfTimeError): a fit simulates
    many times, and a stiff law may take long per simulation."""
    try:
        return compute()
    except OutOfTimeError:
        return fallback
