"""Forward selection of discovered laws: where the largest excess error is, on an axis or a reading, sums of terms are
screened, the best are fitted by output error, and the best fit is added; then again, up to `LAW_MOST_ROUNDS` laws.

Steps and equations: see the theory of operation in the package's docstring (`analysis/diagnosis/discovery`).
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np

from analysis.diagnosis.discovery.antisymmetric_pairs import (
    antisymmetric_pairs,
    as_pair,
    coupling_taken,
    is_coupling,
    pair_starts,
    with_equal_halves,
)
from analysis.diagnosis.discovery.beam import best_sums
from analysis.diagnosis.discovery.evaluate_shape import evaluate_shape
from analysis.diagnosis.discovery.fit_sum import Sum
from analysis.diagnosis.discovery.grammar import AXES
from analysis.diagnosis.discovery.law_of_sum import hypothesis_of_sum, laws_of
from analysis.diagnosis.discovery.matched_filter import View, views_of
from analysis.diagnosis.discovery.screen_terms import cross_validate_terms, products_of
from analysis.diagnosis.discovery.snap_exponents import is_whole_limit, snap_exponents
from analysis.diagnosis.discovery.view_terms import view_terms
from analysis.diagnosis.errors.hypothesis import combine, without_claim
from analysis.diagnosis.errors.output_error import Fitted, evaluate_fit, fit
from analysis.diagnosis.search.compare_candidates import refine
from analysis.diagnosis.search.explain import Explanation, is_worthwhile
from analysis.diagnosis.search.same_within_errors import inseparable
from analysis.diagnosis.search.search_context import FIRST_ROUNDS, FittedCandidate, SearchContext, sensitivity_at
from analysis.diagnosis.settings import (
    AT_RETUNING_BOUND,
    LAW_ALMOST_NOISE,
    LAW_AXES_SHARE,
    LAW_COMMAND_TAKEN,
    LAW_FITTED,
    LAW_FITTED_WITHIN,
    LAW_MOST_ROUNDS,
    LAW_NEAR,
    NOISE_ALONE,
    RETUNING_BOUND,
)
from analysis.diagnosis.types import Progress, TimeBudget
from equalizer.plant.mechanical_model import MechanicalModelError


@dataclass(frozen=True, slots=True, eq=False)
class Round:
    """One law that was added."""

    fitted_candidates: tuple[FittedCandidate, ...]
    """The best first."""
    sums: tuple[Sum, ...]
    """The screened sums in the order of `fitted_candidates`."""
    placebo: float
    """Largest share of the held-out squares that a term takes of a time-shuffled missing force."""

    @property
    def shares_above_noise(self) -> tuple[float, float]:
        """Shares, at most 1, that the law takes of the missing force's held-out squares above the noise, and that
        chance takes."""
        first = self.sums[0]
        above = max(first.without - 1.0, 1e-300)
        taken, by_chance = first.without - first.cross_validated, self.placebo * first.without
        return min(taken / above, 1.0), min(by_chance / above, 1.0)


@dataclass(frozen=True, slots=True, eq=False)
class Discovery:
    found: Explanation
    """`after` holds the laws; its rounds and steps are those of the laws."""
    rounds: tuple[Round, ...]
    chosen_of: int = 1
    """Number of laws that fitted alike, of which the last one was chosen by its error on held-out stretches."""


def discover(context: SearchContext, known: Explanation, progress: Progress, time_left: TimeBudget) -> Discovery | None:
    """The laws found, fitted by output error; None where none is worth its numbers. known: what the named effects
    explain."""
    retuned = known.retuned.fitted
    base = context.candidate(evaluate_fit(context.measure, context.tuning, retuned.deviations, retuned.hypothesis))
    rounds: list[Round] = []
    steps: list[FittedCandidate] = []
    while len(rounds) < LAW_MOST_ROUNDS and time_left() and base.score.worst_channel > NOISE_ALONE:
        progress("looking for a law that has no name", 0.6 + 0.1 * len(rounds))
        found = _find_next_law(context, base.fitted, time_left)
        if found is None or not is_worthwhile(base, found.fitted_candidates[0]):
            break
        if found.sums[0].partner is not None:
            steps.append(_first_half(context, found.fitted_candidates[0]))
        base = found.fitted_candidates[0]
        rounds.append(found)
        steps.append(base)
    if not rounds:
        return None
    snapped = snap_exponents(context, base.fitted)
    last = context.candidate(with_equal_halves(context.measure, context.tuning, snapped))
    steps[-1] = last
    whole = Explanation(
        known.before,
        known.retuned,
        context.with_test_score(last),
        tuple(each.fitted_candidates for each in rounds for _ in range(1 if each.sums[0].partner is None else 2)),
        tuple(steps),
    )
    return Discovery(whole, tuple(rounds))


def _first_half(context: SearchContext, pair: FittedCandidate) -> FittedCandidate:
    """The candidate without the second law of its pair: each named law has a step of its own."""
    hypothesis = without_claim(pair.fitted.hypothesis, len(pair.fitted.hypothesis.claims) - 1)
    return context.candidate(evaluate_fit(context.measure, context.tuning, pair.fitted.deviations, hypothesis))


def _find_next_law(context: SearchContext, base: Fitted, time_left: TimeBudget) -> Round | None:
    views = views_of(context.measure, context.tuning, base)
    searched = [(view, best_sums(products_of(view), view_terms(view), time_left)) for view in _views_to_search(views)]
    every = sorted(
        (
            *(item for view, found in searched for item in found.sums if not _undoes_command(view, item)),
            *antisymmetric_pairs(views),
        ),
        key=lambda item: _explained_squares(views, item),
        reverse=True,
    )
    chosen = _choose_sums_to_fit(_keep_close_to_best(_best_of_each_structure(every)))
    pairs = _fit_sums(context, base, chosen, time_left)
    if not pairs:
        return None
    ranked = _put_plainest_first(context, pairs)
    first = ranked[0][1]
    # Of the axes that it acts along.
    own = [(each.acts_on, each.axis) for each in (first, first.partner) if each is not None]
    placebo = max((found.placebo for view, found in searched if (view.acts_on, view.axis) in own), default=0.0)
    return Round(tuple(item for item, _ in ranked), tuple(item for _, item in ranked), placebo)


def _fit_sums(
    context: SearchContext, base: Fitted, sums: Sequence[Sum], time_left: TimeBudget
) -> tuple[tuple[FittedCandidate, Sum], ...]:
    """The sums fitted by output error: the best one, and plainer ones that are as good, until they converge. Without
    time, the best of those that were begun."""
    known = sensitivity_at(context, base.deviations, base.hypothesis)
    fits = [
        (fit(context.measure, context.tuning, start, known, FIRST_ROUNDS), each)
        for each in sums
        if time_left()
        for start in _starting_fits(context, base, each)
    ]
    fits.sort(key=lambda pair: pair[0].cost)
    if not fits or not np.isfinite(fits[0][0].cost):
        return ()
    best = fits[0]
    # Of a law's two starts the cheaper one may be that which ends where re-tuning without the law did.
    ends = [refine(context, start) for start, each in fits if each is best[1] and np.isfinite(start.cost)]
    refined = [(context.candidate(min(ends, key=lambda end: end.cost)), best[1])]
    others = {id(each): (start, each) for start, each in reversed(fits) if each is not best[1]}
    rest = [
        (context.candidate(_like_best(context, best, refined[0][0], pair)), pair[1])
        for pair in sorted(others.values(), key=lambda pair: pair[0].cost)
    ]
    close = [
        pair
        for pair in rest
        if time_left() and _count_numbers(pair) < _count_numbers(refined[0]) and inseparable(refined[0][0], pair[0])
    ]
    refined += [(context.candidate(refine(context, candidate.fitted)), item) for candidate, item in close]
    return (*refined, *(pair for pair in rest if pair not in close))


def _like_best(
    context: SearchContext, best: tuple[Fitted, Sum], refined: FittedCandidate, other: tuple[Fitted, Sum]
) -> Fitted:
    """The other fit; of a pair of which the best is one half, the refined best as that pair."""
    single, pair = best[1], other[1]
    if single.partner is not None or pair.partner is None or not is_coupling(single):
        return other[0]
    return as_pair(context.measure, context.tuning, (refined.fitted, single), pair) or other[0]


def _choose_sums_to_fit(sums: Sequence[Sum]) -> list[Sum]:
    """The best few sums, and the best one that lacks a variable of the first, so that it has a rival."""
    first = [*sums[:LAW_FITTED]]
    if not first or any(not set(sums[0].variables) <= set(each.variables) for each in first):
        return first
    other = next((each for each in sums if not set(sums[0].variables) <= set(each.variables)), None)
    return first if other is None else [*first, other]


def _put_plainest_first(
    context: SearchContext, pairs: Sequence[tuple[FittedCandidate, Sum]]
) -> list[tuple[FittedCandidate, Sum]]:
    """By error; but first comes, of those that these data cannot tell from the best, the one with fewest numbers; of
    forces that are linear in another axis's motion, the one that asks least of the model's own coupled numbers."""
    ranked = sorted(pairs, key=lambda pair: pair[0].score.mean_log_error)
    alike = [pair for pair in ranked if inseparable(ranked[0][0], pair[0])]
    first = min(alike, key=_count_numbers)
    if is_coupling(first[1]):
        same = [pair for pair in alike if is_coupling(pair[1]) and _count_numbers(pair) == _count_numbers(first)]
        first = min(same, key=lambda pair: coupling_taken(context.tuning, pair[0].fitted))
    return [first, *(pair for pair in ranked if pair is not first)]


def _count_numbers(pair: tuple[FittedCandidate, Sum]) -> int:
    """Free numbers of a sum, without exponents that are whole or half numbers, and a soft limit's factor of 1."""
    candidate, of = pair
    law = laws_of(candidate.fitted.hypothesis)[-1]
    count = 0 if law is None else -int(is_whole_limit(law, LAW_NEAR))
    for term in of.terms:
        plain = [k for k in term.exponents if abs(2 * term.numbers[k] - round(2 * term.numbers[k])) < 2 * LAW_NEAR]
        count += 1 + len(term.numbers) - len(plain)
    return count


def _starting_fits(context: SearchContext, base: Fitted, each: Sum) -> list[Fitted]:
    """The sum added to the fit, with the model's own numbers as they were or shifted as the sum's fit has them,
    whichever costs less; where re-tuning ended at a bound, for want of this law, also with the numbers as given."""
    recording = context.measure.records[0].recording
    shifted = np.clip(base.deviations + each.model_shift, -RETUNING_BOUND, RETUNING_BOUND)
    given = np.zeros_like(base.deviations)
    at_bound = np.abs(base.deviations).max(initial=0.0) >= AT_RETUNING_BOUND * RETUNING_BOUND
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


def _views_to_search(views: Sequence[View]) -> list[View]:
    """Of axes and of readings, the two with the largest excess error each at most, the largest first."""
    found: list[View] = []
    for acts_on in ("force", "response"):
        missing = [(_excess(view), view.output) for view in views if view.acts_on == acts_on]
        most = max((excess for excess, _ in missing), default=0.0)
        worth = [(excess, output) for excess, output in missing if excess > LAW_ALMOST_NOISE]
        found += [
            views[output] for excess, output in sorted(worth, reverse=True)[:2] if excess >= LAW_AXES_SHARE * most
        ]
    return found


def _undoes_command(view: View, each: Sum) -> bool:
    """Whether a force takes more than half of its axis's command away. With mass, damping and stiffness shrinking
    alongside, the balance of forces then holds with nothing on either side: its trivial solution."""
    if each.acts_on != "force":
        return False
    taken = power = 0.0
    for record in view.records:
        command = record.columns[f"f{AXES[each.axis]}"]
        for term, factor in zip(each.terms, each.factors, strict=True):
            force = factor * evaluate_shape(term.shape, term.numbers, record.columns, record.rate_hz)
            taken -= float(force @ command)
        power += float(command @ command)
    return taken > LAW_COMMAND_TAKEN * power


def _excess(view: View) -> float:
    """Held-out squares of the re-tuned model over those of noise alone."""
    base = products_of(view)
    without = cross_validate_terms(base, view.residual[None, :]).without
    return float(without.sum()) / (view.noise * len(view.residual))


def _explained_squares(views: Sequence[View], each: Sum) -> float:
    view = next(view for view in views if (view.acts_on, view.axis) == (each.acts_on, each.axis))
    own = (each.without - each.cross_validated) * view.noise * len(view.residual)
    # A pair's errors are the mean of both halves'.
    return own if each.partner is None else 2 * own


def _keep_close_to_best(sums: Sequence[Sum]) -> list[Sum]:
    """The sums whose error is not much above that of the best one."""
    return [
        each
        for each in sums
        if each.cross_validated - 1 <= LAW_FITTED_WITHIN * max(sums[0].cross_validated - 1, LAW_ALMOST_NOISE - 1)
    ]


def _best_of_each_structure(sums: Sequence[Sum]) -> list[Sum]:
    """The best of each structure."""
    found: dict[object, Sum] = {}
    for each in sums:
        shapes = frozenset(term.shape for term in each.terms)
        found.setdefault((each.acts_on, each.axis, each.partner is None, shapes), each)
    return list(found.values())
