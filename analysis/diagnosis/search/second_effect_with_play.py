"""A second effect next to rattling play: every effect of the catalogue, at several strengths, compared by band power.

Starting values come from the residual waveform, which impacts make chaotic: an estimator then returns a strength that
is wrong by up to an order of magnitude, too small or too large alike at every axis. Each candidate is therefore
evaluated at a geometric row of strengths (a line search in the logarithm of its main parameter), without a fit; the
likeliest candidates are fitted, and the best of these refined with the model's parameters. All costs are those of
`band_power_fit`, about 1 for chance alone.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from analysis.diagnosis.errors.band_power_fit import BandPowerFit, BandPowerProblem, evaluate_hypothesis, fit_band_power
from analysis.diagnosis.errors.hypothesis import Hypothesis, combine_hypotheses, make_claim_hypothesis
from analysis.diagnosis.errors.output_error import evaluate_fit, gather_evidence
from analysis.diagnosis.errors.refine_band_power import refine_band_power, weight_by_chance_variation
from analysis.diagnosis.search.explain import Explanation
from analysis.diagnosis.search.search_context import FITTING, SCREENING, STARTING, SearchContext
from analysis.diagnosis.search.starting_hypotheses import list_candidates
from analysis.diagnosis.settings import IMPACTS_SHARE
from analysis.diagnosis.types import TimeBudget
from equalizer.effects.effect import Effect

PLAY, RIVAL = "backlash", "loose_joint"
"""Play, and the effect that is fitted at the same place as play for comparison."""
FIRST_FACTOR, SMALLER_FACTORS, LARGER_FACTORS = 0.55, (0.3, 0.1, 0.03), (1.8, 3.2)
"""Factors on a starting strength: the first decides the direction, then those below or above follow while the cost
falls. They cover a decade and a half downwards, where the scatter of impacts leads an estimator most. By hand."""
MOST_FITTED, FIRST_ROUNDS, MOST_REFINED = 6, 3, 3
"""Most effects, of different names, that are fitted as a second effect with play; steps of that first fit, in which the
model's parameters are fixed; and most of the fits that are refined, which takes ten times as long. By hand."""
CHANCE_COST = 1.0
"""Expected cost of the right hypothesis: chance variation alone, by the definition of the weights."""
NEAR_CHANCE = 1.2
"""Cost at which nothing further is fitted: the difference is then the chance variation's. By hand."""
BATCH_SIZE = 8
"""Candidates that are evaluated between two looks at the time."""


@dataclass(frozen=True, slots=True, eq=False)
class SecondEffects:
    """Fits of play with a second effect."""

    fits: tuple[BandPowerFit, ...]
    """The best first; empty where no second effect removes enough."""
    complete: bool
    """Whether the time sufficed for all candidates."""


def search_second_effects(
    context: SearchContext,
    explanation: Explanation,
    problem: BandPowerProblem,
    play_fit: BandPowerFit,
    catalogue: Sequence[Effect],
    time_left: TimeBudget,
) -> SecondEffects:
    """Fits of play with a second effect: those that remove at least `IMPACTS_SHARE` of the cost of play alone, on the
    samples to fit and to choose by. None is looked for where even the right pair could not remove so much."""
    weighted = weight_by_chance_variation(problem, play_fit)
    play_cost = evaluate_hypothesis(weighted, play_fit.deviations, play_fit.hypothesis).cost
    if (1 - IMPACTS_SHARE) * play_cost < CHANCE_COST:
        return SecondEffects((), complete=True)
    if not time_left():
        return SecondEffects((), complete=False)
    suggested_hypotheses = _suggest_second_effects(context, explanation, play_fit, catalogue)
    guarded = replace(weighted, map_=context.guard.wrap(weighted.map_, SCREENING))
    starts, has_all_starts = _evaluate_starts(guarded, play_fit, suggested_hypotheses, time_left)
    promising = _select_best_per_effect([start for start in starts if start.cost < play_cost])[:MOST_FITTED]
    first_fits, has_all_fits = _fit_starts(context, weighted, promising, time_left)
    refined, has_all_refined = _refine_fits(context, (problem, weighted), first_fits[:MOST_REFINED], time_left)
    return SecondEffects(
        tuple(fit for cost, fit in refined if cost <= (1 - IMPACTS_SHARE) * play_cost),
        has_all_starts and has_all_fits and has_all_refined,
    )


def _suggest_second_effects(
    context: SearchContext, explanation: Explanation, play_fit: BandPowerFit, catalogue: Sequence[Effect]
) -> list[Hypothesis]:
    """Hypotheses of a second effect in addition to play: each effect of the catalogue with starting values from the
    residuals that play leaves, and the candidates of the first round of the search by waveforms, as fitted there.
    Effects that contain an excluded effect (`SearchContext.excluded`) are left out: they would stand for it."""
    waveform_fit = evaluate_fit(context.measure, context.tuning, play_fit.deviations, play_fit.hypothesis)
    evidence = gather_evidence(context.measure, context.tuning, waveform_fit)[0]
    allowed = [
        effect
        for effect in catalogue
        if effect.name not in (PLAY, RIVAL) and not context.excluded.intersection(effect.simpler)
    ]
    names = {effect.name for effect in allowed}
    first_round = explanation.rounds[0] if explanation.rounds else ()
    fitted_hypotheses = [candidate.fitted.hypothesis for candidate in first_round if candidate.newest in names]
    return [*list_candidates(allowed, evidence, context.guard.wrap(context.map_, STARTING)), *fitted_hypotheses]


def _fit_starts(
    context: SearchContext, weighted: BandPowerProblem, starts: Sequence[BandPowerFit], time_left: TimeBudget
) -> tuple[list[BandPowerFit], bool]:
    """Each start fitted with the model's parameters fixed, the likeliest first, and whether the time sufficed for
    all."""
    guarded_map = context.guard.wrap(map, FITTING)
    fit_first = partial(_fit_first, replace(weighted, ensemble=1))
    first_fits: list[BandPowerFit] = []
    is_complete = True
    for start in starts:
        is_complete = time_left()
        if not is_complete:
            break
        first_fits += guarded_map(fit_first, [start])  # type: ignore[arg-type]
    # Akaike's criterion over the compared bands: a law with more parameters must gain more.
    bands = max(int(np.count_nonzero(weighted.weights)), 1)
    ranked = sorted(first_fits, key=lambda fit: fit.cost + 2 * len(fit.hypothesis.point) / bands)
    return ranked, is_complete


def _fit_first(problem: BandPowerProblem, start: BandPowerFit) -> BandPowerFit:
    return fit_band_power(problem, start, FIRST_ROUNDS)


def _refine_fits(
    context: SearchContext,
    problems: tuple[BandPowerProblem, BandPowerProblem],
    first_fits: Sequence[BandPowerFit],
    time_left: TimeBudget,
) -> tuple[list[tuple[float, BandPowerFit]], bool]:
    """Fits with the model's parameters and their costs, the best first, and whether the time sufficed for all.
    problems: without weights, and weighted by the chance variation of play, for the costs."""
    problem, weighted = problems
    fits: list[tuple[float, BandPowerFit]] = []
    for start in first_fits:
        if not time_left():
            return sorted(fits, key=lambda fit: fit[0]), False
        name = start.hypothesis.claims[-1].effect.name
        fitted = context.guard.run(name, FITTING, partial(_refine, problem, start, time_left), start)
        fits.append((evaluate_hypothesis(weighted, fitted.deviations, fitted.hypothesis).cost, fitted))
        if fits[-1][0] <= NEAR_CHANCE:
            break
    return sorted(fits, key=lambda fit: fit[0]), True


def _refine(problem: BandPowerProblem, start: BandPowerFit, time_left: TimeBudget) -> BandPowerFit:
    return refine_band_power(weight_by_chance_variation(problem, start), start, time_left)


def _evaluate_starts(
    weighted: BandPowerProblem,
    play_fit: BandPowerFit,
    suggested_hypotheses: Sequence[Hypothesis],
    time_left: TimeBudget,
) -> tuple[list[BandPowerFit], bool]:
    """Each suggestion with play at its best strength, and whether the time sufficed for all. One simulation each: the
    scatter between simulations is in the weights."""
    single = replace(weighted, ensemble=1, map_=map)

    def search_strength(hypothesis: Hypothesis) -> BandPowerFit:
        return _search_strength(single, play_fit, hypothesis)

    starts: list[BandPowerFit] = []
    for first in range(0, len(suggested_hypotheses), BATCH_SIZE):
        if first and not time_left():
            return starts, False
        starts += weighted.map_(search_strength, suggested_hypotheses[first : first + BATCH_SIZE])  # type: ignore[arg-type]
    return starts, True


def _search_strength(problem: BandPowerProblem, play_fit: BandPowerFit, second_effect: Hypothesis) -> BandPowerFit:
    """Play with the second effect at the strength with the least cost (`FIRST_FACTOR`). An effect is evaluated as
    suggested where no strength can be scaled: without parameters, with a main one that is read from the data (such as a
    step), or with one that is not zero where the effect is absent (such as a gain, or a limit)."""

    def evaluate(hypothesis: Hypothesis) -> BandPowerFit:
        return evaluate_hypothesis(problem, play_fit.deviations, combine_hypotheses(play_fit.hypothesis, hypothesis))

    best = evaluate(second_effect)
    main = next(iter(second_effect.claims[-1].effect.parameters), None)
    if main is None or main.fixed or main.none != 0:
        return best
    weaker = evaluate(_scale_strength(second_effect, FIRST_FACTOR))
    factors = SMALLER_FACTORS if weaker.cost < best.cost else LARGER_FACTORS
    best = min(best, weaker, key=_get_cost)
    for factor in factors:
        trial = evaluate(_scale_strength(second_effect, factor))
        if trial.cost >= best.cost:
            break
        best = trial
    return best


def _scale_strength(hypothesis: Hypothesis, factor: float) -> Hypothesis:
    """The hypothesis of one effect with its main parameter times the factor, at all its sites."""
    (claim,) = hypothesis.claims
    main_name = claim.effect.parameters[0].name
    values = [placed_effect.values for placed_effect in hypothesis.list_placed_effects()]
    return make_claim_hypothesis(claim, [{**group, main_name: factor * group[main_name]} for group in values])


def _select_best_per_effect(starts: Sequence[BandPowerFit]) -> list[BandPowerFit]:
    """The best start of each effect, by rising cost."""
    best_by_effect: dict[str, BandPowerFit] = {}
    for start in sorted(starts, key=_get_cost):
        best_by_effect.setdefault(start.hypothesis.claims[-1].effect.name, start)
    return list(best_by_effect.values())


def _get_cost(fit: BandPowerFit) -> float:
    return fit.cost
