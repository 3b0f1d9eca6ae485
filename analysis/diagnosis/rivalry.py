"""Fits of the hypotheses that a screen left over, the best first, and which of them the data cannot tell apart."""

from collections.abc import Sequence
from dataclasses import dataclass

from analysis.diagnosis.error_measure import ErrorMeasure
from analysis.diagnosis.output_error import Fitted, Sensitivity, evaluated, fit, sensitivity
from analysis.diagnosis.screening import Mapper, Screened
from analysis.diagnosis.standing import Standing, standing
from analysis.diagnosis.tuning import Tuning

FITTED = 10
"""Hypotheses that get a first fit."""
REFINED = 4
"""And a second one, with everything recomputed where they stand."""
FIRST_ROUNDS, SECOND_ROUNDS = 3, 5


@dataclass(frozen=True, slots=True, eq=False)
class Contender:
    fitted: Fitted
    standing: Standing


@dataclass(frozen=True, slots=True, eq=False)
class Arena:
    """What all fits share."""

    measure: ErrorMeasure
    tuning: Tuning
    map_: Mapper

    def contender(self, fitted: Fitted) -> Contender:
        return Contender(fitted, standing(self.measure, fitted.residuals, self.measure.noise))


def contest(arena: Arena, base: Fitted, known: Sensitivity, screened: Sequence[Screened]) -> tuple[Contender, ...]:
    """The best first. known: of the model's own numbers, near the base."""
    measure, tuning = arena.measure, arena.tuning

    def first(one: Screened) -> Fitted:
        return fit(measure, tuning, evaluated(measure, tuning, base.deviations, one.hypothesis), known, FIRST_ROUNDS)

    fits: list[Fitted] = list(arena.map_(first, _varied(screened)[:FITTED]))  # type: ignore[arg-type]
    fits.sort(key=lambda one: one.cost)
    refined = [refine(arena, one) for one in fits[:REFINED]]
    contenders = [arena.contender(one) for one in [*refined, *fits[REFINED:]]]
    return tuple(sorted(contenders, key=lambda one: one.standing.chosen_by))


def refine(arena: Arena, fitted: Fitted) -> Fitted:
    """To the end, with what the model's numbers do recomputed there."""
    there = sensitivity(arena.measure, arena.tuning, fitted.deviations, fitted.hypothesis, arena.map_)
    return fit(arena.measure, arena.tuning, fitted, there, SECOND_ROUNDS)


def _varied(screened: Sequence[Screened]) -> list[Screened]:
    """The best start of each hypothesis before the second start of any."""
    seen: dict[object, int] = {}
    ranked = []
    for one in screened:
        key = one.hypothesis.key
        seen[key] = seen.get(key, -1) + 1
        ranked.append((seen[key], one))
    return [one for _, one in sorted(ranked, key=lambda pair: pair[0])]
