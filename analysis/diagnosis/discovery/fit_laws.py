"""Fits sums of terms as laws by output error, and puts the simplest of those that fit about equally well first.

Screening uses a linearised residual (`fit_sum`); here, each sum is simulated with the model, and all parameters are
fitted together by Gauss-Newton steps (`errors.output_error`).
"""

from collections.abc import Callable, Sequence
from functools import partial
from itertools import product
from typing import TypeVar

import numpy as np

from analysis.diagnosis.discovery.antisymmetric_pairs import as_pair, is_coupling, pair_starts, sum_squares_of_coupling
from analysis.diagnosis.discovery.fit_sum import Sum
from analysis.diagnosis.discovery.law_of_sum import hypothesis_of_sum, laws_of
from analysis.diagnosis.discovery.snap_exponents import is_whole_limit
from analysis.diagnosis.errors.hypothesis import combine
from analysis.diagnosis.errors.output_error import Fitted, evaluate_fit, fit
from analysis.diagnosis.search.compare_candidates import refine
from analysis.diagnosis.search.parsimony import inseparable
from analysis.diagnosis.search.search_context import FIRST_ROUNDS, FittedCandidate, SearchContext, sensitivity_at
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
    known = within_time(lambda: sensitivity_at(context, base.deviations, base.hypothesis), None)
    if known is None:
        return ()
    first = partial(fit, context.measure, context.tuning, known=known, rounds=FIRST_ROUNDS, map_=context.map_)
    fits = [
        (within_time(partial(first, start), start), each)
        for each in sums
        if time_left()
        for start in _make_starting_fits(context, base, each)
    ]
    fits.sort(key=lambda pair: pair[0].cost)
    if not fits or not np.isfinite(fits[0][0].cost):
        return ()
    best = fits[0]
    # Of the starts of a law, that with the lower cost may converge to the fit of the re-tuned model without the law.
    ends = [_refine(context, start) for start, each in fits if each is best[1] and np.isfinite(start.cost)]
    refined = [(context.candidate(min(ends, key=lambda end: end.cost)), best[1])]
    others = {id(each): (start, each) for start, each in reversed(fits) if each is not best[1]}
    rest = [
        (context.candidate(_like_best(context, best, refined[0][0], pair)), pair[1])
        for pair in sorted(others.values(), key=lambda pair: pair[0].cost)
    ]
    close = [
        pair
        for pair in rest
        if time_left()
        and _count_parameters(pair) < _count_parameters(refined[0])
        and inseparable(refined[0][0], pair[0])
    ]
    refined += [(context.candidate(_refine(context, candidate.fitted)), item) for candidate, item in close]
    return (*refined, *(pair for pair in rest if pair not in close))


def _make_starting_fits(context: SearchContext, base: Fitted, each: Sum) -> list[Fitted]:
    """The sum added to the fit, with the model's own parameters unchanged or shifted as in the fit of the sum: the
    start with the lower cost. Where re-tuning without this law ended at a bound, also a start with the given
    parameters."""
    recording = context.measure.records[0].recording
    bound = context.tuning.bound
    shifted = np.clip(base.deviations + each.model_shift, -bound, bound)
    given = np.zeros_like(base.deviations)
    at_bound = context.tuning.is_at_bound(base.deviations)
    starts = (each,) if each.partner is None else pair_starts(each)
    chosen: list[Fitted] = []
    for several in ((base.deviations, shifted), *([(given,)] if at_bound else [])):
        found: list[Fitted] = []
        for start, deviations in product(starts, several):
            whole = combine(base.hypothesis, hypothesis_of_sum(start, recording))
            try:
                found.append(evaluate_fit(context.measure, context.tuning, deviations, whole))
            except (MechanicalModelError, np.linalg.LinAlgError):
                continue
        chosen += [min(found, key=lambda start: start.cost)] if found else []
    return chosen


def _like_best(
    context: SearchContext, best: tuple[Fitted, Sum], refined: FittedCandidate, other: tuple[Fitted, Sum]
) -> Fitted:
    """The other fit; if it is a pair of which the best sum is a half, the refined best fit converted to that pair."""
    single, pair = best[1], other[1]
    if single.partner is not None or pair.partner is None or not is_coupling(single):
        return other[0]
    return as_pair(context.measure, context.tuning, (refined.fitted, single), pair) or other[0]


def put_plainest_first(
    context: SearchContext, pairs: Sequence[tuple[FittedCandidate, Sum]]
) -> list[tuple[FittedCandidate, Sum]]:
    """The candidates by rising error, with the preferred one moved to the front: among those inseparable from the best,
    the one with the fewest parameters; among forces that are linear in another axis's motion, the one with the smallest
    change of the model's own coupled parameters."""
    ranked = sorted(pairs, key=lambda pair: pair[0].score.mean_log_error)
    alike = [pair for pair in ranked if inseparable(ranked[0][0], pair[0])]
    first = min(alike, key=_count_parameters)
    if is_coupling(first[1]):
        same = [pair for pair in alike if is_coupling(pair[1]) and _count_parameters(pair) == _count_parameters(first)]
        first = min(same, key=lambda pair: sum_squares_of_coupling(context.tuning, pair[0].fitted))
    return [first, *(pair for pair in ranked if pair is not first)]


def _count_parameters(pair: tuple[FittedCandidate, Sum]) -> int:
    """Number of free parameters of a sum. Exponents that are whole or half numbers are not counted, nor is the factor
    of a soft limit that is 1."""
    candidate, of = pair
    law = laws_of(candidate.fitted.hypothesis)[-1]
    count = 0 if law is None else -int(is_whole_limit(law, LAW_NEAR))
    for term in of.terms:
        plain = [k for k in term.exponents if abs(2 * term.numbers[k] - round(2 * term.numbers[k])) < 2 * LAW_NEAR]
        count += 1 + len(term.numbers) - len(plain)
    return count


def _refine(context: SearchContext, start: Fitted) -> Fitted:
    """The fit continued to convergence; the start where the time ends before."""
    return within_time(lambda: refine(context, start), start)


def within_time(work: Callable[[], T], begun: T) -> T:
    """The result of `work`, or `begun` where the time ends during it: a stiff law may take a second per simulation, and
    a fit simulates about a hundred times."""
    try:
        return work()
    except OutOfTimeError:
        return begun
