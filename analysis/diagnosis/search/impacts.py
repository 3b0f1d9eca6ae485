"""Rattling play (backlash): its waveform is chaotic and cannot be predicted, so hypotheses are compared by band powers.

Two simulations of a drive with play diverge within a few impacts, however small their initial difference (Ott, Chaos in
Dynamical Systems, chapter 4). The difference between two simulations of one hypothesis, its chance variation, is
therefore used in place of the noise.

Where play alone leaves clearly more than chance, a second effect is searched for (`second_effect_with_play`).
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from analysis.diagnosis.errors.band_power import BandPower
from analysis.diagnosis.errors.band_power_fit import BandPowerFit, View, evaluate_hypothesis, fit_band_power
from analysis.diagnosis.errors.excited_segments import select_excited_segments
from analysis.diagnosis.errors.free_simulation import FreeSimulation
from analysis.diagnosis.errors.hypothesis import (
    NOTHING,
    Claim,
    Hypothesis,
    combine,
    hypothesis_of_claim,
    without_claim,
)
from analysis.diagnosis.errors.output_error import evaluate_fit, gather_evidence
from analysis.diagnosis.errors.refine_band_power import refine_band_power
from analysis.diagnosis.noise.channel_noise import ChannelNoise
from analysis.diagnosis.noise.noise_floor import NoiseFloor
from analysis.diagnosis.search.band_power_comparison import (
    BandPowerComparison,
    comparison_of,
    is_as_good,
    is_convincing,
    worst_part,
)
from analysis.diagnosis.search.explain import Explanation, Statistic
from analysis.diagnosis.search.identifiability import open_effects
from analysis.diagnosis.search.search_context import SearchContext
from analysis.diagnosis.search.second_effect_with_play import (
    RIVAL,
    SecondEffects,
    fit_second_effects,
    suggest_second_effects,
)
from analysis.diagnosis.search.time_budget import always
from analysis.diagnosis.settings import (
    EXPLAINED_BY_CHANCE,
    PEAKED_KURTOSIS,
    VARIES_ERROR,
)
from analysis.diagnosis.types import TimeBudget
from equalizer.effects.effect import Effect, Values
from equalizer.effects.starts.evidence import Evidence

WORDS = "band power of the response"
WIDTHS = np.geomspace(0.02, 5.0, 13)
"""Starting values of the gap that are tried, relative to the estimated gap."""
FIRST_ROUNDS = 5
"""Steps of the first fit, in which the model's parameters are fixed."""


def explain_impacts(
    context: SearchContext,
    found: Explanation,
    floors: Sequence[NoiseFloor],
    catalogue: Sequence[Effect],
    time_left: TimeBudget = always,
) -> Explanation | None:
    """The explanation by play, compared by band power; None where the response is regular, where play does not explain
    it, or where responses are not simulated freely. floors: noise per recording. time_left: called before a second
    effect is looked for."""
    effects = {effect.name: effect for effect in catalogue}
    if "backlash" not in effects or not isinstance(context.whole, FreeSimulation):
        return None
    if not is_irregular(context, found, floors):
        return None
    given = evaluate_fit(context.measure, context.tuning, np.zeros(len(context.tuning.names)), NOTHING)
    evidence = gather_evidence(context.measure, context.tuning, given)[0]
    view = View(BandPower(context.measure), context.tuning, context.map_)
    claims = [Claim(effects["backlash"], "one", (axis,)) for axis in range(context.tuning.model.inputs)]
    places = sorted((_fit_claim(view, evidence, claim) for claim in claims), key=lambda claim: claim.cost)
    if places[0].cost >= evaluate_hypothesis(view, given.deviations, NOTHING).cost:
        return None
    play = refine_band_power(view, places[0])
    rivals = list(places[1:])
    if RIVAL in effects:
        rivals.append(_fit_claim(view, evidence, Claim(effects[RIVAL], "one", play.hypothesis.claims[0].sites)))
    hypotheses = [rival.hypothesis for rival in rivals if rival.hypothesis.claims and np.isfinite(rival.cost)]
    second = SecondEffects((), True)
    comparison = comparison_of(context, play)
    if worst_part(comparison.score_candidate(play.deviations, play.hypothesis)) > EXPLAINED_BY_CHANCE and time_left():
        suggested = suggest_second_effects(context, found, play, catalogue)
        second = fit_second_effects(view, play, suggested, time_left)
    # Where the best pair is not confirmed, the next one is judged, and at last play alone.
    for number in range(len(second.fits) + 1):
        pairs = second.fits[number:]
        named = _judge(comparison_of(context, (*pairs, play)[0]), found, view, (play, pairs), hypotheses)
        if named is not None and _is_determined(context, view, named, (*pairs, play)[0]):
            return replace(named, ended_early=named.ended_early or not second.complete)
    return None


def _is_determined(context: SearchContext, view: View, named: Explanation, fit: BandPowerFit) -> bool:
    """Whether the recordings determine the effects: none has an open parameter, and the gap is needed, because play of
    no gap is not the cause of the irregular response."""
    return not any(open_effects(context, named)) and _needs_gap(comparison_of(context, fit), view, fit)


def _needs_gap(comparison: BandPowerComparison, view: View, best: BandPowerFit) -> bool:
    """Whether the gap is needed: with the gap fixed at its least value and all else refitted, the misfit is far larger
    (profile of the likelihood at a gap of zero)."""
    claim, placed = best.hypothesis.claims[0], best.hypothesis.list_placed_effects()[0]
    free = claim.effect.parameters
    closed = replace(claim.effect, parameters=tuple(replace(p, fixed=p.fixed or p.name == "gap") for p in free))
    gap = next(p.lower for p in free if p.name == "gap")
    hypothesis = combine(
        hypothesis_of_claim(replace(claim, effect=closed), [{**placed.values, "gap": gap}]),
        without_claim(best.hypothesis, 0),
    )
    without = refine_band_power(view, evaluate_hypothesis(view, best.deviations, hypothesis))
    if not np.isfinite(without.cost):
        return False
    each = [comparison.score_candidate(fitted.deviations, fitted.hypothesis) for fitted in (best, without)]
    return is_convincing(*each)


def _fit_claim(view: View, evidence: Evidence, claim: Claim) -> BandPowerFit:
    """The best fit of a claim on the segments that excite its axis, over a grid of starting gaps, with the model's
    parameters fixed; the model without effects where the claim has no starting values."""
    measure = view.power.measure
    assert isinstance(measure, FreeSimulation)
    near = View(BandPower(select_excited_segments(measure, claim.sites[0])), view.tuning, view.map_)
    given = np.zeros(len(view.tuning.names))
    starts = claim.effect.starts(evidence, claim.sites[0])[:1]
    net = [{**values, "gap": float(wide * values["gap"])} for values in starts for wide in WIDTHS]

    def at(values: Values) -> BandPowerFit:
        return evaluate_hypothesis(near, given, hypothesis_of_claim(claim, [values]))

    tried: list[BandPowerFit] = list(near.map_(at, net))  # type: ignore[arg-type]
    best = fit_band_power(near, min(tried, key=lambda trial: trial.cost), FIRST_ROUNDS) if tried else None
    return evaluate_hypothesis(view, given, NOTHING if best is None else best.hypothesis)


def _judge(
    comparison: BandPowerComparison,
    found: Explanation,
    view: View,
    fits: tuple[BandPowerFit, Sequence[BandPowerFit]],
    others: Sequence[Hypothesis],
) -> Explanation | None:
    """The explanation by play, and by a second effect if there is one; None where the re-tuned model, another effect or
    a rival of play is about as good. comparison: with the chance variation of the best fit. fits: of play alone, and
    with a second effect, the best first. others: the rivals. A second effect must also be better than play alone."""
    alone, beside = fits
    best = (*beside, alone)[0]
    played = comparison.score_candidate(alone.deviations, alone.hypothesis)
    both = tuple(comparison.score_candidate(each.deviations, each.hypothesis) for each in beside)
    named = (*both, played)[0]
    given = np.zeros_like(best.deviations)
    before = comparison.score_candidate(given, NOTHING)
    linear = [
        before,
        *(comparison.score_candidate(at, NOTHING) for at in (found.retuned.fitted.deviations, best.deviations)),
    ]
    retuned = min(linear, key=lambda candidate: candidate.score.mean_log_error)
    rivals = [comparison.score_candidate(given, rival) for rival in others]
    earlier = [
        comparison.score_candidate(candidate.fitted.deviations, candidate.fitted.hypothesis)
        for candidate in (*(found.rounds[0] if found.rounds else ()), *found.steps[1:])
        if candidate.fitted.hypothesis.key[-1] != alone.hypothesis.key[-1]
    ]
    simpler = (*earlier, played) if both else earlier
    if not is_convincing(named, retuned) or any(is_as_good(each, named) for each in simpler):
        return None
    for rival in (each for each in rivals if is_as_good(each, played)):
        if not beside:
            return None
        second = without_claim(best.hypothesis, 0)
        start = evaluate_hypothesis(view, given, combine(rival.fitted.hypothesis, second))
        with_second = fit_band_power(view, start, FIRST_ROUNDS)
        if is_as_good(comparison.score_candidate(with_second.deviations, with_second.hypothesis), named):
            return None
    rivals = sorted([*rivals, *earlier], key=lambda rival: rival.score.mean_log_error)
    statistic = Statistic(WORDS, comparison.chance, best.errors)
    rounds = ((played, *rivals), *((both,) if both else ()))
    return Explanation(before, retuned, named, rounds, (played, *both[:1]), statistic)


def is_irregular(context: SearchContext, found: Explanation, floors: Sequence[NoiseFloor]) -> bool:
    """Whether a response is irregular, like that of rattling play: periods of a segment vary by more than
    `VARIES_ERROR` times the noise or, without repeats, a channel's residual has a kurtosis above `PEAKED_KURTOSIS`."""
    if any(floor.how == "repeats" for floor in floors):
        return any(_varies(channel) for floor in floors for channel in (floor.response, floor.position) if channel)
    masks = [record.fit | record.choose for record in context.whole.records]
    left = np.vstack([row[mask] for row, mask in zip(found.retuned.fitted.residuals, masks, strict=True)])
    if not len(left):
        return False
    left = left - left.mean(axis=0)
    power = np.mean(left**2, axis=0)
    return bool(np.any(np.mean(left**4, axis=0) > PEAKED_KURTOSIS * np.maximum(power, np.finfo(float).tiny) ** 2))


def _varies(noise: ChannelNoise) -> bool:
    """Whether the variance between the periods of a segment exceeds (VARIES_ERROR rms)² in a channel."""
    return any(bool(np.any(segment.variance > (VARIES_ERROR * noise.rms) ** 2)) for segment in noise.segments)
