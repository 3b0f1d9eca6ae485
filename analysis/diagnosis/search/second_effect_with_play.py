"""A second effect next to rattling play: every effect of the catalogue, at several strengths, compared by band power.

Starting values come from the residual waveform, which impacts make chaotic: an estimator then returns a strength that
is wrong by up to an order of magnitude, too small or too large alike at every axis. Each candidate is therefore
evaluated at a geometric row of strengths (a line search in the logarithm of its main parameter), without a fit; the
likeliest candidates are fitted, and the best of these refined with the model's parameters. All costs are those of
`band_power_fit`, about 1 for chance alone.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from analysis.diagnosis.errors.band_power_fit import BandPowerFit, View, evaluate_hypothesis, fit_band_power
from analysis.diagnosis.errors.hypothesis import Hypothesis, combine, hypothesis_of_claim
from analysis.diagnosis.errors.output_error import evaluate_fit, gather_evidence
from analysis.diagnosis.errors.refine_band_power import refine_band_power, weight_by_chance
from analysis.diagnosis.search.explain import Explanation
from analysis.diagnosis.search.search_context import STARTING, SearchContext
from analysis.diagnosis.search.starting_hypotheses import candidates
from analysis.diagnosis.settings import IMPACTS_SHARE
from analysis.diagnosis.types import TimeBudget
from equalizer.effects.effect import Effect

PLAY, RIVAL = "backlash", "loose_joint"
"""Play, and the effect that is fitted at the same place as play for comparison."""
FIRST_FACTOR, SMALLER, LARGER = 0.55, (0.3, 0.1, 0.03), (1.8, 3.2)
"""Factors on a starting strength: the first decides the direction, then those below or above follow while the cost
falls. They cover a decade and a half downwards, where the scatter of impacts leads an estimator most. By hand."""
MOST_FITTED, FIRST_ROUNDS, MOST_REFINED = 6, 3, 3
"""Most effects, of different names, that are fitted as a second effect with play; steps of that first fit, in which the
model's parameters are fixed; and most of the fits that are refined, which takes ten times as long. By hand."""
NEAR_CHANCE = 1.2
"""Cost at which no further candidate is fitted: the difference is then the chance variation's. By hand."""
BATCH = 8
"""Candidates that are evaluated between two looks at the time."""


@dataclass(frozen=True, slots=True, eq=False)
class SecondEffects:
    """Fits of play with a second effect."""

    fits: tuple[BandPowerFit, ...]
    """The best first; empty where no second effect removes enough."""
    complete: bool
    """Whether the time sufficed for all candidates."""


def suggest_second_effects(
    context: SearchContext, found: Explanation, play: BandPowerFit, catalogue: Sequence[Effect]
) -> list[Hypothesis]:
    """Hypotheses of a second effect in addition to play: each effect of the catalogue with starting values from the
    residuals that play leaves, and the candidates of the first round of the search by waveforms, as fitted there.
    Effects that contain an excluded effect (`SearchContext.barred`) are left out: they would stand for it."""
    played = evaluate_fit(context.measure, context.tuning, play.deviations, play.hypothesis)
    evidence = gather_evidence(context.measure, context.tuning, played)[0]
    allowed = [
        effect
        for effect in catalogue
        if effect.name not in (PLAY, RIVAL) and not context.barred.intersection(effect.simpler)
    ]
    names = {effect.name for effect in allowed}
    first_round = found.rounds[0] if found.rounds else ()
    fitted = [tried.fitted.hypothesis for tried in first_round if tried.newest in names]
    return [*candidates(allowed, evidence, context.guard.over(context.map_, STARTING)), *fitted]


def fit_second_effects(
    view: View, play: BandPowerFit, suggested: Sequence[Hypothesis], time_left: TimeBudget
) -> SecondEffects:
    """Fits of play with a second effect: those that remove at least `IMPACTS_SHARE` of the cost of play alone, on the
    samples to fit and to choose by."""
    weighted = weight_by_chance(view, play)
    of_play = evaluate_hypothesis(weighted, play.deviations, play.hypothesis).cost
    starts, complete = _evaluate_starts(weighted, play, suggested, time_left)
    promising = _best_per_effect([start for start in starts if start.cost < of_play])[:MOST_FITTED]
    single = replace(weighted, ensemble=1)
    # Akaike's criterion over the compared bands: a law with more parameters must gain more.
    bands = max(int(np.count_nonzero(weighted.weights)), 1)
    first_fits = sorted(
        (fit_band_power(single, start, FIRST_ROUNDS) for start in promising),
        key=lambda fit: fit.cost + 2 * len(fit.hypothesis.point) / bands,
    )
    fits: list[tuple[float, BandPowerFit]] = []
    for start in first_fits[:MOST_REFINED]:
        if fits and not time_left():
            complete = False
            break
        fitted = refine_band_power(view, start)
        cost = evaluate_hypothesis(weighted, fitted.deviations, fitted.hypothesis).cost
        fits.append((cost, fitted))
        if cost <= NEAR_CHANCE:
            break
    ranked = sorted(fits, key=lambda fit: fit[0])
    return SecondEffects(tuple(fit for cost, fit in ranked if cost <= (1 - IMPACTS_SHARE) * of_play), complete)


def _evaluate_starts(
    weighted: View, play: BandPowerFit, suggested: Sequence[Hypothesis], time_left: TimeBudget
) -> tuple[list[BandPowerFit], bool]:
    """Each suggestion with play at its best strength, and whether the time sufficed for all. One simulation each: the
    scatter between simulations is in the weights."""
    single = replace(weighted, ensemble=1, map_=map)

    def at_best_strength(hypothesis: Hypothesis) -> BandPowerFit:
        return _search_strength(single, play, hypothesis)

    starts: list[BandPowerFit] = []
    for first in range(0, len(suggested), BATCH):
        if first and not time_left():
            return starts, False
        starts += weighted.map_(at_best_strength, suggested[first : first + BATCH])  # type: ignore[arg-type]
    return starts, True


def _search_strength(view: View, play: BandPowerFit, second: Hypothesis) -> BandPowerFit:
    """Play with the second effect at the strength with the least cost (`FIRST_FACTOR`). An effect whose main parameter
    does not vanish without it, such as a gain, is evaluated as suggested."""

    def evaluate(factor: float) -> BandPowerFit:
        return evaluate_hypothesis(view, play.deviations, combine(play.hypothesis, _scale_strength(second, factor)))

    best = evaluate(1.0)
    if second.claims[-1].effect.parameters[0].none != 0:
        return best
    weaker = evaluate(FIRST_FACTOR)
    factors = SMALLER if weaker.cost < best.cost else LARGER
    best = min(best, weaker, key=_cost_of)
    for factor in factors:
        tried = evaluate(factor)
        if tried.cost >= best.cost:
            break
        best = tried
    return best


def _scale_strength(hypothesis: Hypothesis, factor: float) -> Hypothesis:
    """The hypothesis of one effect with its main parameter times the factor, at all its sites."""
    (claim,) = hypothesis.claims
    main = claim.effect.parameters[0].name
    placed = hypothesis.list_placed_effects()
    return hypothesis_of_claim(claim, [{**each.values, main: factor * each.values[main]} for each in placed])


def _best_per_effect(starts: Sequence[BandPowerFit]) -> list[BandPowerFit]:
    """The best start of each effect, by rising cost."""
    likeliest: dict[str, BandPowerFit] = {}
    for start in sorted(starts, key=_cost_of):
        likeliest.setdefault(start.hypothesis.claims[-1].effect.name, start)
    return list(likeliest.values())


def _cost_of(fit: BandPowerFit) -> float:
    return fit.cost
