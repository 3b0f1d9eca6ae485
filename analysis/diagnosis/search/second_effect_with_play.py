"""Search for a second effect in addition to rattling play (backlash), by band powers.

Starting values come from the residual waveform, which impacts make chaotic: the estimated strength may be wrong by an
order of magnitude, by about the same factor at every axis. Each effect of the catalogue is therefore evaluated at
several strengths (a line search in the logarithm of its main parameter, where it can be scaled), without a fit; those
with the least cost are fitted, and the best of these refined with the model's parameters. All costs are those of
`band_power_fit`, about 1 for chance variation alone.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from analysis.diagnosis.errors.band_power_fit import BandPowerFit, BandPowerProblem, evaluate_hypothesis, fit_band_power
from analysis.diagnosis.errors.hypothesis import Hypothesis, combine_hypotheses, make_claim_hypothesis
from analysis.diagnosis.errors.output_error import evaluate_fit, gather_evidence
from analysis.diagnosis.errors.refine_band_power import refine_band_power, weight_by_chance_variation
from analysis.diagnosis.limits import IMPACTS_SHARE
from analysis.diagnosis.search.explain import Explanation
from analysis.diagnosis.search.parsimony import list_relatives
from analysis.diagnosis.search.search_context import FITTING, SCREENING, STARTING, SearchContext
from analysis.diagnosis.search.starting_hypotheses import list_candidates
from analysis.diagnosis.types import TimeBudget
from equalizer.effects.effect import Effect

PLAY, RIVAL_EFFECT = "backlash", "loose_joint"
"""Catalogue names of play, and of the effect that `impacts` fits at the same place for comparison."""
FIRST_STRENGTH_FACTOR, SMALLER_STRENGTH_FACTORS, LARGER_STRENGTH_FACTORS = 0.55, (0.3, 0.1, 0.03), (1.8, 3.2)
"""Factors on a starting strength: the first decides the direction, then those below or above follow while the cost
falls. They reach further down (1.5 decades) than up (0.5), because impacts mostly make an estimate too large.
Chosen."""
MAX_FIRST_FITS, FIRST_FIT_STEPS, MAX_REFINED_FITS = 6, 3, 3
"""Largest number of effects, of different names, that are fitted as a second effect with play; steps of that first fit,
in which the model's parameters are fixed; and largest number of fits that are refined, which takes ten times as long.
Chosen."""
CHANCE_COST = 1.0
"""Expected cost of the true hypothesis: chance variation alone, by the definition of the weights."""
SUFFICIENT_COST = 1.2
"""Cost up to which no further effect is fitted: the excess over `CHANCE_COST` is then within the chance variation.
Chosen."""
BATCH_SIZE = 8
"""Number of candidates that are evaluated between two checks of the time limit. Chosen."""


@dataclass(frozen=True, slots=True, eq=False)
class SecondEffects:
    """Fits of play with a second effect."""

    fits: tuple[BandPowerFit, ...]
    """The best first; empty where no second effect removes enough."""
    complete: bool
    """Whether the time sufficed for all candidates; True where none had to be tried."""


def search_second_effects(
    context: SearchContext,
    explanation: Explanation,
    problem: BandPowerProblem,
    play_fit: BandPowerFit,
    catalogue: Sequence[Effect],
    time_left: TimeBudget,
) -> SecondEffects:
    """Search for fits of play with a second effect that remove at least `IMPACTS_SHARE` of the cost of play alone, on
    the samples to fit and to choose by. None is tried where even a cost of `CHANCE_COST` would not remove so much."""
    weighted_problem = weight_by_chance_variation(problem, play_fit)
    play_cost = evaluate_hypothesis(weighted_problem, play_fit.deviations, play_fit.hypothesis).cost
    if (1 - IMPACTS_SHARE) * play_cost < CHANCE_COST:
        return SecondEffects((), complete=True)
    if not time_left():
        return SecondEffects((), complete=False)
    starts, has_all_starts = _find_starts(context, explanation, (weighted_problem, play_fit), catalogue, time_left)
    best_starts = _select_best_per_effect([start for start in starts if start.cost < play_cost])[:MAX_FIRST_FITS]
    first_fits, has_all_fits = _fit_starts(context, weighted_problem, best_starts, time_left)
    refined_fits, has_all_refined = _refine_fits(
        context, (problem, weighted_problem), first_fits[:MAX_REFINED_FITS], time_left
    )
    return SecondEffects(
        tuple(fit for cost, fit in refined_fits if cost <= (1 - IMPACTS_SHARE) * play_cost),
        has_all_starts and has_all_fits and has_all_refined,
    )


def _find_starts(
    context: SearchContext,
    explanation: Explanation,
    play: tuple[BandPowerProblem, BandPowerFit],
    catalogue: Sequence[Effect],
    time_left: TimeBudget,
) -> tuple[list[BandPowerFit], bool]:
    """Evaluate hypotheses of a second effect: the candidates of the first round of the search by waveforms, as fitted
    there, then each effect of the catalogue other than play and a loose joint. If one of the former leaves
    `SUFFICIENT_COST`, waveform and band powers both show it: only its relatives and special cases are then compared
    with it. Effects that contain an excluded effect (`SearchContext.excluded`) as a special case are left out, because
    they would replace it. Returns also whether the time sufficed. play: the weighted problem, and the fit of play."""
    weighted_problem, play_fit = play
    guarded_problem = replace(weighted_problem, map_=context.guard.wrap(weighted_problem.map_, SCREENING))
    effects = [
        effect
        for effect in catalogue
        if effect.name not in (PLAY, RIVAL_EFFECT) and not context.excluded.intersection(effect.simpler)
    ]
    allowed_names = {effect.name for effect in effects}
    first_round = explanation.rounds[0] if explanation.rounds else ()
    tried_hypotheses = [candidate.fitted.hypothesis for candidate in first_round if candidate.newest in allowed_names]
    tried_starts, has_all_tried = _evaluate_starts(guarded_problem, play_fit, tried_hypotheses, time_left)
    best_start = min(tried_starts, key=_get_cost, default=None)
    if best_start is not None and best_start.cost <= SUFFICIENT_COST:
        shown_effect = best_start.hypothesis.claims[-1].effect
        related = {*shown_effect.simpler, *(effect.name for effect in list_relatives(shown_effect.name, effects))}
        effects = [effect for effect in effects if effect.name in related]
        tried_starts = [start for start in tried_starts if start.hypothesis.claims[-1].effect.name in related]
    suggested_hypotheses = _suggest_second_effects(context, play_fit, effects)
    starts, has_all_starts = _evaluate_starts(guarded_problem, play_fit, suggested_hypotheses, time_left)
    return [*tried_starts, *starts], has_all_tried and has_all_starts


def _suggest_second_effects(
    context: SearchContext, play_fit: BandPowerFit, effects: Sequence[Effect]
) -> tuple[Hypothesis, ...]:
    """Suggest hypotheses of these effects with starting values from the residuals of play."""
    waveform_fit = evaluate_fit(context.measure, context.tuning, play_fit.deviations, play_fit.hypothesis)
    evidence = gather_evidence(context.measure, context.tuning, waveform_fit)[0]
    return list_candidates(effects, evidence, context.guard.wrap(context.map_, STARTING))


def _fit_starts(
    context: SearchContext, weighted_problem: BandPowerProblem, starts: Sequence[BandPowerFit], time_left: TimeBudget
) -> tuple[list[BandPowerFit], bool]:
    """Fit each start with the model's parameters fixed. Returns the fits, the least value of Akaike's criterion first,
    and whether the time sufficed for all."""
    guarded_map = context.guard.wrap(map, FITTING)
    first_problem = replace(weighted_problem, ensemble=1)
    first_fits: list[BandPowerFit] = []
    is_complete = True
    for start in starts:
        is_complete = time_left()
        if not is_complete:
            break
        first_fits += guarded_map(  # type: ignore[arg-type]
            lambda begun: fit_band_power(first_problem, begun, FIRST_FIT_STEPS), [start]
        )
    # Akaike's criterion per compared band: cost + 2 (number of parameters) / (number of bands).
    band_count = max(int(np.count_nonzero(weighted_problem.weights)), 1)
    ranked_fits = sorted(first_fits, key=lambda fit: fit.cost + 2 * len(fit.hypothesis.point) / band_count)
    return ranked_fits, is_complete


def _refine_fits(
    context: SearchContext,
    problems: tuple[BandPowerProblem, BandPowerProblem],
    first_fits: Sequence[BandPowerFit],
    time_left: TimeBudget,
) -> tuple[list[tuple[float, BandPowerFit]], bool]:
    """Refine the fits together with the model's parameters, until one has `SUFFICIENT_COST`; where no time is left for
    the first, it is kept as it is. Returns costs and fits, the best first, and whether the time sufficed. problems:
    without weights, and weighted by the chance variation of play, from which the costs are."""
    problem, weighted_problem = problems
    fits: list[tuple[float, BandPowerFit]] = []
    is_complete = True
    for start in first_fits:
        is_complete = time_left()
        if not is_complete and fits:
            break
        refine_start = partial(refine_weighted, problem, start, time_left)
        effect_name = start.hypothesis.claims[-1].effect.name
        fitted = context.guard.run(effect_name, FITTING, refine_start, start) if is_complete else start
        fits.append((evaluate_hypothesis(weighted_problem, fitted.deviations, fitted.hypothesis).cost, fitted))
        if fits[-1][0] <= SUFFICIENT_COST or not is_complete:
            break
    return sorted(fits, key=lambda fit: fit[0]), is_complete


def refine_weighted(problem: BandPowerProblem, start: BandPowerFit, time_left: TimeBudget) -> BandPowerFit:
    """Refine a fit under the weights of its own chance variation."""
    return refine_band_power(weight_by_chance_variation(problem, start), start, time_left)


def _evaluate_starts(
    weighted_problem: BandPowerProblem,
    play_fit: BandPowerFit,
    suggested_hypotheses: Sequence[Hypothesis],
    time_left: TimeBudget,
) -> tuple[list[BandPowerFit], bool]:
    """Evaluate each suggestion with play at its best strength; returns also whether the time sufficed for all (the
    first batch is always evaluated). One simulation each: the scatter between simulations is in the weights."""
    single_simulation = replace(weighted_problem, ensemble=1, map_=map)

    def search_strength(hypothesis: Hypothesis) -> BandPowerFit:
        return _search_strength(single_simulation, play_fit, hypothesis)

    starts: list[BandPowerFit] = []
    for batch_start in range(0, len(suggested_hypotheses), BATCH_SIZE):
        if batch_start and not time_left():
            return starts, False
        starts += weighted_problem.map_(search_strength, suggested_hypotheses[batch_start : batch_start + BATCH_SIZE])  # type: ignore[arg-type]
    return starts, True


def _search_strength(problem: BandPowerProblem, play_fit: BandPowerFit, second_effect: Hypothesis) -> BandPowerFit:
    """Evaluate play with the second effect at the strength with the least cost among the factors, in order of their
    distance, until the cost rises. The suggested strength alone is evaluated where it cannot be scaled: without
    parameters, with a main one that is read from the data (such as a step), or with one that is not zero where the
    effect is absent (such as a gain, or a limit)."""

    def evaluate_with_play(hypothesis: Hypothesis) -> BandPowerFit:
        """Evaluate play together with a second effect."""
        return evaluate_hypothesis(problem, play_fit.deviations, combine_hypotheses(play_fit.hypothesis, hypothesis))

    best_fit = evaluate_with_play(second_effect)
    main_parameter = next(iter(second_effect.claims[-1].effect.parameters), None)
    if main_parameter is None or main_parameter.fixed or main_parameter.none != 0:
        return best_fit
    weaker_fit = evaluate_with_play(_scale_strength(second_effect, FIRST_STRENGTH_FACTOR))
    further_factors = SMALLER_STRENGTH_FACTORS if weaker_fit.cost < best_fit.cost else LARGER_STRENGTH_FACTORS
    best_fit = min(best_fit, weaker_fit, key=_get_cost)
    for factor in further_factors:
        scaled_fit = evaluate_with_play(_scale_strength(second_effect, factor))
        if scaled_fit.cost >= best_fit.cost:
            break
        best_fit = scaled_fit
    return best_fit


def _scale_strength(hypothesis: Hypothesis, factor: float) -> Hypothesis:
    """Multiply the main (first) parameter of a hypothesis of one effect by the factor, at all its sites."""
    (claim,) = hypothesis.claims
    main_parameter = claim.effect.parameters[0].name
    values = [placed_effect.values for placed_effect in hypothesis.list_placed_effects()]
    return make_claim_hypothesis(
        claim, [{**site_values, main_parameter: factor * site_values[main_parameter]} for site_values in values]
    )


def _select_best_per_effect(starts: Sequence[BandPowerFit]) -> list[BandPowerFit]:
    """Select the start with the least cost of each effect, by rising cost."""
    best_by_effect: dict[str, BandPowerFit] = {}
    for start in sorted(starts, key=_get_cost):
        best_by_effect.setdefault(start.hypothesis.claims[-1].effect.name, start)
    return list(best_by_effect.values())


def _get_cost(fit: BandPowerFit) -> float:
    """Get the cost, as a sorting key."""
    return fit.cost
