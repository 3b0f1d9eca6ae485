"""Fits sums of terms as laws by output error, and puts the simplest of those that fit about equally well first.

Screening uses a linearised residual (`fit_sum`); here, each sum is simulated with the model, and all parameters are
fitted together by Gauss-Newton steps (`errors.output_error`).
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
from analysis.diagnosis.search.compare_candidates import refine
from analysis.diagnosis.search.parsimony import are_inseparable
from analysis.diagnosis.search.search_context import (
    FIRST_FIT_ROUNDS,
    FittedCandidate,
    SearchContext,
    compute_sensitivity,
)
from analysis.diagnosis.search.short_recordings import coarsen_steps, shorten_recordings
from analysis.diagnosis.search.time_budget import OutOfTimeError
from analysis.diagnosis.settings import LAW_NEAR
from analysis.diagnosis.types import TimeBudget
from equalizer.plant.mechanical_model import MechanicalModelError

T = TypeVar("T")


def fit_sums(
    context: SearchContext, base: Fitted, sums: Sequence[Sum], time_left: TimeBudget
) -> tuple[tuple[FittedCandidate, Sum], ...]:
    """The sums fitted by output error. The best sum, and simpler sums that are inseparable from it, are fitted to
    convergence, the others for a few steps. When the time ends, those begun by then; empty where none can be fitted."""
    fit_few_steps = _prepare_first_fits(context, base)
    fits = [
        (run_within_time(partial(fit_few_steps, start), start), term_sum)
        for term_sum in sums
        if time_left()
        for start in _make_starting_fits(context, base, term_sum)
    ]
    fits.sort(key=lambda pair: pair[0].cost)
    if not fits or not np.isfinite(fits[0][0].cost):
        return ()
    best = fits[0]
    # Of the starts of a law, that with the lower cost may converge to the fit of the re-tuned model without the law.
    converged = [_refine(context, start) for start, term_sum in fits if term_sum is best[1] and np.isfinite(start.cost)]
    refined = [(context.score_fit(min(converged, key=lambda end: end.cost)), best[1])]
    other_fits = {id(term_sum): (start, term_sum) for start, term_sum in reversed(fits) if term_sum is not best[1]}
    other_candidates = [
        (context.score_fit(_convert_to_pair(context, best, refined[0][0], pair)), pair[1])
        for pair in sorted(other_fits.values(), key=lambda pair: pair[0].cost)
    ]
    simpler_candidates = [
        pair
        for pair in other_candidates
        if time_left()
        and _count_parameters(pair) < _count_parameters(refined[0])
        and are_inseparable(refined[0][0], pair[0])
    ]
    refined += [(context.score_fit(_refine(context, candidate.fitted)), item) for candidate, item in simpler_candidates]
    return (*refined, *(pair for pair in other_candidates if pair not in simpler_candidates))


def _prepare_first_fits(context: SearchContext, base: Fitted) -> Callable[[Fitted], Fitted]:
    """Make the function that fits a start for a few steps. Where the drive repeats and the law does not depend on time,
    it uses one period of each segment and longer simulation steps (`short_recordings`), which suffices for a ranking;
    its result is that of all samples."""
    tuning, short_form = context.tuning, shorten_recordings(context, base)
    compute_sensitivity_to_model = cache(lambda ctx: compute_sensitivity(ctx, base.deviations, base.hypothesis))
    short = None
    if short_form is not None:
        short = replace(short_form.context, measure=coarsen_steps(short_form.context.measure))

    def fit_few_steps(start: Fitted) -> Fitted:
        depends_on_time = any(effect.effect.of_time for effect in start.hypothesis.list_placed_effects())
        if short is None or depends_on_time:
            sensitivity = compute_sensitivity_to_model(context)
            return fit(context.measure, tuning, start, sensitivity, FIRST_FIT_ROUNDS, context.map_)
        sensitivity = compute_sensitivity_to_model(short)
        short_start = evaluate_fit(short.measure, tuning, start.deviations, start.hypothesis)
        fitted = fit(short.measure, tuning, short_start, sensitivity, FIRST_FIT_ROUNDS, context.map_)
        on_all_samples = evaluate_fit(context.measure, tuning, fitted.deviations, fitted.hypothesis)
        return min(on_all_samples, start, key=lambda candidate: candidate.cost)

    return fit_few_steps


def _make_starting_fits(context: SearchContext, base: Fitted, term_sum: Sum) -> list[Fitted]:
    """The sum added to the fit, with the model's own parameters unchanged or shifted as in the fit of the sum: the
    start with the lower cost. Where re-tuning without this law ended at a bound, also a start with the given
    parameters."""
    recording = context.measure.records[0].recording
    bound = context.tuning.bound
    shifted = np.clip(base.deviations + term_sum.model_shift, -bound, bound)
    calibrated = np.zeros_like(base.deviations)
    at_bound = context.tuning.is_at_bound(base.deviations)
    starts = (term_sum,) if term_sum.partner is None else list_pair_starts(term_sum)
    chosen: list[Fitted] = []
    for deviation_sets in ((base.deviations, shifted), *([(calibrated,)] if at_bound else [])):
        fits: list[Fitted] = []
        for start, deviations in product(starts, deviation_sets):
            hypothesis = combine_hypotheses(base.hypothesis, convert_sum_to_hypothesis(start, recording))
            try:
                fits.append(evaluate_fit(context.measure, context.tuning, deviations, hypothesis))
            except (MechanicalModelError, np.linalg.LinAlgError):
                continue
        chosen += [min(fits, key=lambda start: start.cost)] if fits else []
    return chosen


def _convert_to_pair(
    context: SearchContext, best: tuple[Fitted, Sum], refined: FittedCandidate, other_fit: tuple[Fitted, Sum]
) -> Fitted:
    """The other fit; if it is a pair of which the best sum is a half, the refined best fit converted to that pair."""
    single, pair = best[1], other_fit[1]
    if single.partner is not None or pair.partner is None or not is_coupling(single):
        return other_fit[0]
    return convert_to_pair(context.measure, context.tuning, (refined.fitted, single), pair) or other_fit[0]


def put_simplest_first(
    context: SearchContext, pairs: Sequence[tuple[FittedCandidate, Sum]]
) -> list[tuple[FittedCandidate, Sum]]:
    """The candidates by rising error, with the preferred one moved to the front: among those inseparable from the best,
    the one with the fewest parameters; among forces that are linear in another axis's motion, the one with the smallest
    change of the model's own coupled parameters."""
    ranked = sorted(pairs, key=lambda pair: pair[0].score.mean_log_error)
    equivalent = [pair for pair in ranked if are_inseparable(ranked[0][0], pair[0])]
    first = min(equivalent, key=_count_parameters)
    if is_coupling(first[1]):
        equally_simple = [
            pair for pair in equivalent if is_coupling(pair[1]) and _count_parameters(pair) == _count_parameters(first)
        ]
        first = min(equally_simple, key=lambda pair: sum_squared_coupling_deviations(context.tuning, pair[0].fitted))
    return [first, *(pair for pair in ranked if pair is not first)]


def _count_parameters(pair: tuple[FittedCandidate, Sum]) -> int:
    """Number of free parameters of a sum. Exponents that are whole or half numbers are not counted, nor is the factor
    of a soft limit that is 1."""
    candidate, term_sum = pair
    law = list_fitted_laws(candidate.fitted.hypothesis)[-1]
    count = 0 if law is None else -int(is_full_soft_limit(law, LAW_NEAR))
    for term in term_sum.terms:
        simple_exponents = [
            k for k in term.exponents if abs(2 * term.numbers[k] - round(2 * term.numbers[k])) < 2 * LAW_NEAR
        ]
        count += 1 + len(term.numbers) - len(simple_exponents)
    return count


def _refine(context: SearchContext, start: Fitted) -> Fitted:
    """The fit continued to convergence; the start where the time ends before."""
    return run_within_time(lambda: refine(context, start), start)


def run_within_time(work: Callable[[], T], fallback: T) -> T:
    """The result of `work`, or `fallback` where the time ends during it: a stiff law may take a second per simulation,
    and a fit simulates about a hundred times."""
    try:
        return work()
    except OutOfTimeError:
        return fallback
