"""Forward selection of laws that have no name: where most is missing, the best sum of terms, fitted by output error."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from analysis.diagnosis.discovery.as_effect import hypothesis_of, law_of_sum
from analysis.diagnosis.discovery.beam import Searched, best_sums
from analysis.diagnosis.discovery.grammar import axes_of, periodic, terms_of
from analysis.diagnosis.discovery.screen import products_of, tried
from analysis.diagnosis.discovery.snap import snapped
from analysis.diagnosis.discovery.sums import Sum
from analysis.diagnosis.discovery.whitened import View, views_of
from analysis.diagnosis.errors.hypothesis import together
from analysis.diagnosis.errors.output_error import Fitted, evaluated, fit
from analysis.diagnosis.search.compare_candidates import refine
from analysis.diagnosis.search.explain import Explanation, worthwhile
from analysis.diagnosis.search.same_within_errors import inseparable
from analysis.diagnosis.search.search_context import FIRST_ROUNDS, FittedCandidate, SearchContext, sensitivity_at
from analysis.diagnosis.settings import (
    LAW_ALMOST_NOISE,
    LAW_AXES_SHARE,
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
    """As the screen had them; the first is that of the first candidate."""
    placebo: float
    """Share of the held-out squares that the best term takes of a missing force out of its time."""
    taken: float
    """The same share of the missing force itself, by the law."""


@dataclass(frozen=True, slots=True, eq=False)
class Discovered:
    found: Explanation
    """`after` holds the laws; its rounds and steps are those of the laws."""
    rounds: tuple[Round, ...]


def discover(
    context: SearchContext, known: Explanation, progress: Progress, time_left: TimeBudget
) -> Discovered | None:
    """None where no law is found that is worth its numbers. known: what the named effects explain."""
    retuned = known.retuned.fitted
    base = context.candidate(evaluated(context.measure, context.tuning, retuned.deviations, retuned.hypothesis))
    rounds: list[Round] = []
    steps: list[FittedCandidate] = []
    while len(rounds) < LAW_MOST_ROUNDS and time_left() and base.score.worst_channel > NOISE_ALONE:
        progress("looking for a law that has no name", 0.6 + 0.1 * len(rounds))
        found = _next(context, base.fitted, time_left)
        if found is None or not worthwhile(base, found.fitted_candidates[0]):
            break
        base = found.fitted_candidates[0]
        rounds.append(found)
        steps.append(base)
    if not rounds:
        return None
    last = context.candidate(snapped(context, base.fitted))
    steps[-1] = last
    whole = Explanation(
        known.before,
        known.retuned,
        context.confirmed(last),
        tuple(each.fitted_candidates for each in rounds),
        tuple(steps),
    )
    return Discovered(whole, tuple(rounds))


def _next(context: SearchContext, base: Fitted, time_left: TimeBudget) -> Round | None:
    views = views_of(context.measure, context.tuning, base)
    searched = [_along(view, time_left) for view in _where(views)]
    every = sorted(
        (item for found in searched for item in found.sums), key=lambda item: _taken(views, item), reverse=True
    )
    sums = _with_other_variables(_near(_different(every)))
    if not sums:
        return None
    known = sensitivity_at(context, base.deviations, base.hypothesis)
    fits: list[tuple[Fitted, Sum]] = []
    for each in sums:
        start = _started(context, base, each)
        if start is not None:
            fits.append((fit(context.measure, context.tuning, start, known, FIRST_ROUNDS), each))
    fits.sort(key=lambda pair: pair[0].cost)
    if not fits or not np.isfinite(fits[0][0].cost):
        return None
    refined = [(context.candidate(refine(context, fits[0][0])), fits[0][1])]
    rest = [(context.candidate(fitted), item) for fitted, item in fits[1:]]
    close = [pair for pair in rest if _price(pair[1]) < _price(fits[0][1]) and inseparable(refined[0][0], pair[0])]
    refined += [(context.candidate(refine(context, candidate.fitted)), item) for candidate, item in close]
    ranked = _plainest_first([*refined, *(pair for pair in rest if pair not in close)])
    first = ranked[0][1]
    # Of the axis that it acts along.
    placebo = max(found.placebo for found in searched if any(item.axis == first.axis for item in found.sums))
    taken = 1 - first.crossed / max(first.without, 1e-300)
    return Round(tuple(item for item, _ in ranked), tuple(item for _, item in ranked), placebo, taken)


def _with_other_variables(sums: Sequence[Sum]) -> list[Sum]:
    """The best few, and the best that lacks a variable of the first, if it is no further off."""
    first = [*sums[:LAW_FITTED]]
    if not first or any(not set(sums[0].variables) <= set(each.variables) for each in first):
        return first
    other = next((each for each in sums if not set(sums[0].variables) <= set(each.variables)), None)
    return first if other is None else [*first, other]


def _plainest_first(pairs: Sequence[tuple[FittedCandidate, Sum]]) -> list[tuple[FittedCandidate, Sum]]:
    """The best first; of those that these data cannot part from it, the one with the fewest numbers to be told."""
    ranked = sorted(pairs, key=lambda pair: pair[0].score.mean_log_error)
    alike = [pair for pair in ranked if inseparable(ranked[0][0], pair[0])]
    first = min(alike, key=lambda pair: _price(pair[1]))
    return [first, *(pair for pair in ranked if pair is not first)]


def _price(of: Sum) -> int:
    """Numbers that have to be told: an exponent that is a whole or half number is none."""
    told = 0
    for term in of.terms:
        plain = [k for k in term.exponents if abs(2 * term.numbers[k] - round(2 * term.numbers[k])) < 2 * LAW_NEAR]
        told += 1 + len(term.numbers) - len(plain)
    return told


def _started(context: SearchContext, base: Fitted, each: Sum) -> Fitted | None:
    """With the model's own numbers as they were, or as the sum wants them."""
    recording = context.measure.records[0].recording
    law = hypothesis_of(law_of_sum(each, recording), each.axis, recording)
    found: list[Fitted] = []
    for deviations in (base.deviations, np.clip(base.deviations + each.moved, -RETUNING_BOUND, RETUNING_BOUND)):
        try:
            found.append(evaluated(context.measure, context.tuning, deviations, together(base.hypothesis, law)))
        except (MechanicalModelError, np.linalg.LinAlgError):
            continue
    return min(found, key=lambda start: start.cost, default=None)


def _where(views: Sequence[View]) -> list[View]:
    """The axes at which most is missing, the first first."""
    missing = [(_excess(view), view.axis) for view in views]
    most = max(excess for excess, _ in missing)
    worth = [(excess, axis) for excess, axis in missing if excess > LAW_ALMOST_NOISE]
    return [views[axis] for excess, axis in sorted(worth, reverse=True)[:2] if excess >= LAW_AXES_SHARE * most]


def _excess(view: View) -> float:
    """Held-out squares of the re-tuned model over the noise's."""
    base = products_of(view)
    without = tried(base, view.residual[None, :]).without
    return float(without.sum()) / (view.noise * len(view.residual))


def _along(view: View, time_left: TimeBudget) -> Searched:
    seen = view.records[0]
    axes = axes_of(seen.columns, seen.left.shape[1])
    terms = terms_of(axes, view.axis, len(seen.left) / seen.rate_hz, seen.rate_hz)
    lines = periodic(seen.columns, axes[view.axis], seen.left[:, view.axis], seen.rate_hz)
    return best_sums(products_of(view), (*terms, *lines), time_left)


def _taken(views: Sequence[View], each: Sum) -> float:
    view = views[each.axis]
    return (each.without - each.crossed) * view.noise * len(view.residual)


def _near(sums: Sequence[Sum]) -> list[Sum]:
    """Those that leave not much more than the best one."""
    return [
        each for each in sums if each.crossed - 1 <= LAW_FITTED_WITHIN * max(sums[0].crossed - 1, LAW_ALMOST_NOISE - 1)
    ]


def _different(sums: Sequence[Sum]) -> list[Sum]:
    """The best of each structure."""
    found: dict[tuple[int, frozenset[str]], Sum] = {}
    for each in sums:
        found.setdefault((each.axis, frozenset(term.shape for term in each.terms)), each)
    return list(found.values())
