"""Explain an irregular response by play (backlash) with impacts, compared by the power in frequency bands.

Two simulations of a drive with play diverge within a few impacts, however small their initial difference (Ott, Chaos in
Dynamical Systems, chapter 4). Waveforms can therefore not be compared. Band powers are compared instead (`band_power`),
and the difference between two simulations of one hypothesis, its chance variation, takes the place of the noise.

Steps of `explain_impacts`:

1. nothing is fitted unless the response is irregular (`is_irregular`);
2. play is fitted on each driven axis, and the best of these fits refined together with the model's parameters;
3. where play leaves more than the chance variation, a second effect is added (`second_effect_with_play`);
4. the result counts if no simpler or rival hypothesis is about as good (`_judge_play`), the data determine all
   parameters, and a gap of zero fits clearly worse (`_needs_gap`).
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from analysis.diagnosis.errors.band_power import BandPower
from analysis.diagnosis.errors.band_power_fit import BandPowerFit, BandPowerProblem, evaluate_hypothesis, fit_band_power
from analysis.diagnosis.errors.excited_segments import select_excited_segments
from analysis.diagnosis.errors.free_simulation import FreeSimulation
from analysis.diagnosis.errors.hypothesis import (
    NO_EFFECTS,
    Claim,
    Hypothesis,
    combine_hypotheses,
    make_claim_hypothesis,
    remove_claim,
)
from analysis.diagnosis.errors.output_error import evaluate_fit, gather_evidence
from analysis.diagnosis.errors.refine_band_power import refine_band_power, weight_by_chance_variation
from analysis.diagnosis.limits import EXPLAINED_BY_CHANCE, IRREGULAR_ERROR, PEAKED_KURTOSIS
from analysis.diagnosis.noise.channel_noise import ChannelNoise
from analysis.diagnosis.noise.noise_floor import NoiseFloor
from analysis.diagnosis.search.band_power_comparison import (
    BandPowerComparison,
    compute_worst_misfit,
    is_as_good,
    is_convincing,
    make_band_power_comparison,
)
from analysis.diagnosis.search.explain import Explanation, Statistic
from analysis.diagnosis.search.identifiability import find_undetermined
from analysis.diagnosis.search.search_context import SearchContext
from analysis.diagnosis.search.second_effect_with_play import (
    PLAY,
    RIVAL_EFFECT,
    SUFFICIENT_COST,
    SecondEffects,
    refine_weighted,
    search_second_effects,
)
from analysis.diagnosis.search.time_budget import grant_time
from analysis.diagnosis.types import TimeBudget
from equalizer.effects.effect import Effect, Values
from equalizer.effects.starts.evidence import Evidence

GAP_FACTORS = np.geomspace(0.02, 5.0, 13)
"""Starting values of the gap, relative to the estimated gap. Chosen by hand."""
PLAY_FIT_STEPS = 5
"""Gauss-Newton steps of the first fit of play, in which the model's parameters are fixed. Chosen."""


def explain_impacts(
    context: SearchContext,
    explanation: Explanation,
    floors: Sequence[NoiseFloor],
    catalogue: Sequence[Effect],
    time_left: TimeBudget = grant_time,
) -> Explanation | None:
    """Explain the response by play, alone or with a second effect. None where the response is regular, where play does
    not explain it, where the model without play differs by chance alone, where the time ends before that is known,
    where play is not in the catalogue, or where the error measure is no free simulation.

    explanation: result of the search by waveforms. floors: noise of each record.
    """
    effects_by_name = {effect.name: effect for effect in catalogue}
    if PLAY not in effects_by_name or not isinstance(context.full_measure, FreeSimulation):
        return None
    if not is_irregular(context, explanation, floors):
        return None
    given_fit = evaluate_fit(context.measure, context.tuning, np.zeros(len(context.tuning.names)), NO_EFFECTS)
    evidence = gather_evidence(context.measure, context.tuning, given_fit)[0]
    problem = BandPowerProblem(BandPower(context.measure), context.tuning, context.map_)
    play_claims = [Claim(effects_by_name[PLAY], "one", (axis,)) for axis in range(context.tuning.model.inputs)]
    axis_fits = sorted((_fit_claim(problem, evidence, claim) for claim in play_claims), key=lambda fit: fit.cost)
    if axis_fits[0].cost >= evaluate_hypothesis(problem, given_fit.deviations, NO_EFFECTS).cost:
        return None
    weighted_problem = weight_by_chance_variation(problem, axis_fits[0])
    retuned_deviations = explanation.retuned.fitted.deviations
    if evaluate_hypothesis(weighted_problem, retuned_deviations, NO_EFFECTS).cost <= SUFFICIENT_COST:
        return None  # the band powers of the model without play differ from the recorded ones by chance alone
    if not time_left():
        return None
    play_fit = refine_band_power(weighted_problem, axis_fits[0], time_left)
    rival_fits = list(axis_fits[1:])
    if RIVAL_EFFECT in effects_by_name:
        rival_claim = Claim(effects_by_name[RIVAL_EFFECT], "one", play_fit.hypothesis.claims[0].sites)
        rival_fits.append(_fit_claim(problem, evidence, rival_claim))
    rival_hypotheses = [rival.hypothesis for rival in rival_fits if rival.hypothesis.claims and np.isfinite(rival.cost)]
    play_comparison = make_band_power_comparison(context, play_fit)
    play_candidate = play_comparison.score_candidate(play_fit.deviations, play_fit.hypothesis)
    is_explained = compute_worst_misfit(play_candidate) <= EXPLAINED_BY_CHANCE
    second_effects = SecondEffects((), complete=True)
    if not is_explained:
        second_effects = search_second_effects(context, explanation, problem, play_fit, catalogue, time_left)
    fits = (play_fit, second_effects.fits)
    result = _find_confirmed_explanation(context, explanation, problem, fits, rival_hypotheses, play_comparison)
    return result and replace(result, ended_early=result.ended_early or not second_effects.complete)


def _find_confirmed_explanation(
    context: SearchContext,
    explanation: Explanation,
    problem: BandPowerProblem,
    fits: tuple[BandPowerFit, Sequence[BandPowerFit]],
    rival_hypotheses: Sequence[Hypothesis],
    play_comparison: BandPowerComparison,
) -> Explanation | None:
    """Find the first explanation that the recordings confirm: by play with a second effect, the best fit first, then by
    play alone; None without any. An explanation is confirmed if `_judge_play` accepts it, all its parameters are
    determined, and `_needs_gap` is True, because play without a gap causes no irregular response. fits,
    rival_hypotheses: as for `_judge_play`. play_comparison: with the chance variation of play alone."""
    play_fit, all_pair_fits = fits
    for pair_index in range(len(all_pair_fits) + 1):
        pair_fits = all_pair_fits[pair_index:]
        best_fit = (*pair_fits, play_fit)[0]
        comparison = make_band_power_comparison(context, best_fit) if pair_fits else play_comparison
        play_explanation = _judge_play(comparison, explanation, problem, (play_fit, pair_fits), rival_hypotheses)
        if play_explanation is None or any(find_undetermined(context, play_explanation)):
            continue
        if _needs_gap(comparison, problem, best_fit):
            return play_explanation
    return None


def _needs_gap(comparison: BandPowerComparison, problem: BandPowerProblem, best_fit: BandPowerFit) -> bool:
    """Whether a gap of zero is ruled out: with the gap fixed at its least value and all other parameters fitted again,
    the misfit is much larger (profile likelihood; `is_convincing`). False where that fit diverges."""
    claim, placed_effect = best_fit.hypothesis.claims[0], best_fit.hypothesis.list_placed_effects()[0]
    effect_parameters = claim.effect.parameters
    gapless_effect = replace(
        claim.effect,
        parameters=tuple(
            replace(parameter, fixed=parameter.fixed or parameter.name == "gap") for parameter in effect_parameters
        ),
    )
    smallest_gap = next(parameter.lower for parameter in effect_parameters if parameter.name == "gap")
    hypothesis = combine_hypotheses(
        make_claim_hypothesis(replace(claim, effect=gapless_effect), [{**placed_effect.values, "gap": smallest_gap}]),
        remove_claim(best_fit.hypothesis, 0),
    )
    # Without a time limit: a comparison with an unfinished fit of the alternative would favour play.
    gapless_start = evaluate_hypothesis(problem, best_fit.deviations, hypothesis)
    gapless_fit = refine_weighted(problem, gapless_start, grant_time)
    if not np.isfinite(gapless_fit.cost):
        return False
    candidates = [
        comparison.score_candidate(fitted.deviations, fitted.hypothesis) for fitted in (best_fit, gapless_fit)
    ]
    return is_convincing(*candidates)


def _fit_claim(problem: BandPowerProblem, evidence: Evidence, claim: Claim) -> BandPowerFit:
    """Fit a claim with the model's parameters fixed, and evaluate it on all segments. It is fitted on the segments that
    excite its axis, from the best of several starting gaps (`GAP_FACTORS`). Without starting values, the model without
    effects is returned."""
    measure = problem.power.measure
    assert isinstance(measure, FreeSimulation)
    segment_problem = BandPowerProblem(
        BandPower(select_excited_segments(measure, claim.sites[0])), problem.tuning, problem.map_
    )
    no_deviations = np.zeros(len(problem.tuning.names))
    starts = claim.effect.starts(evidence, claim.sites[0])[:1]
    start_values = [{**values, "gap": float(factor * values["gap"])} for values in starts for factor in GAP_FACTORS]

    def evaluate(values: Values) -> BandPowerFit:
        return evaluate_hypothesis(segment_problem, no_deviations, make_claim_hypothesis(claim, [values]))

    trial_fits: list[BandPowerFit] = list(segment_problem.map_(evaluate, start_values))  # type: ignore[arg-type]
    best_fit = (
        fit_band_power(segment_problem, min(trial_fits, key=lambda trial: trial.cost), PLAY_FIT_STEPS)
        if trial_fits
        else None
    )
    return evaluate_hypothesis(problem, no_deviations, NO_EFFECTS if best_fit is None else best_fit.hypothesis)


def _judge_play(
    comparison: BandPowerComparison,
    explanation: Explanation,
    problem: BandPowerProblem,
    fits: tuple[BandPowerFit, Sequence[BandPowerFit]],
    rival_hypotheses: Sequence[Hypothesis],
) -> Explanation | None:
    """Judge play, with a second effect if there is one, and return the explanation. None where the re-tuned model,
    another effect or a rival of play is about as good, or a second effect does not improve on play alone.
    comparison: with the chance variation of the best fit. fits: of play alone, and with a second effect, the best
    first. rival_hypotheses: play on other axes, and the effect `RIVAL_EFFECT`."""
    play_fit, pair_fits = fits
    best_fit = (*pair_fits, play_fit)[0]
    play_candidate = comparison.score_candidate(play_fit.deviations, play_fit.hypothesis)
    pair_candidates = tuple(comparison.score_candidate(pair.deviations, pair.hypothesis) for pair in pair_fits)
    best_candidate = (*pair_candidates, play_candidate)[0]
    no_deviations = np.zeros_like(best_fit.deviations)
    deviation_sets = (no_deviations, explanation.retuned.fitted.deviations, best_fit.deviations)
    linear_candidates = [comparison.score_candidate(deviations, NO_EFFECTS) for deviations in deviation_sets]
    given_candidate = linear_candidates[0]
    retuned_candidate = min(linear_candidates, key=lambda candidate: candidate.score.mean_log_error)
    rival_candidates = [comparison.score_candidate(no_deviations, rival) for rival in rival_hypotheses]
    waveform_candidates = [
        comparison.score_candidate(candidate.fitted.deviations, candidate.fitted.hypothesis)
        for candidate in (*(explanation.rounds[0] if explanation.rounds else ()), *explanation.steps[1:])
        if candidate.fitted.hypothesis.key[-1] != play_fit.hypothesis.key[-1]
    ]
    simpler_candidates = (*waveform_candidates, play_candidate) if pair_candidates else waveform_candidates
    is_simpler_as_good = any(is_as_good(candidate, best_candidate) for candidate in simpler_candidates)
    if is_simpler_as_good or not is_convincing(best_candidate, retuned_candidate):
        return None
    for rival in (scored for scored in rival_candidates if is_as_good(scored, play_candidate)):
        if not pair_fits:
            return None
        second_effect = remove_claim(best_fit.hypothesis, 0)
        start = evaluate_hypothesis(problem, no_deviations, combine_hypotheses(rival.fitted.hypothesis, second_effect))
        rival_pair = fit_band_power(problem, start, PLAY_FIT_STEPS)
        if is_as_good(comparison.score_candidate(rival_pair.deviations, rival_pair.hypothesis), best_candidate):
            return None
    rival_candidates = sorted([*rival_candidates, *waveform_candidates], key=lambda rival: rival.score.mean_log_error)
    statistic = Statistic(comparison.chance_variation, best_fit.errors)
    rounds = ((play_candidate, *rival_candidates), *((pair_candidates,) if pair_candidates else ()))
    steps = (play_candidate, *pair_candidates[:1])
    return Explanation(given_candidate, retuned_candidate, best_candidate, rounds, steps, statistic)


def is_irregular(context: SearchContext, explanation: Explanation, floors: Sequence[NoiseFloor]) -> bool:
    """Whether a response is irregular, as with play that rattles: the periods of a segment vary by more than
    `IRREGULAR_ERROR` times the noise or, without repeats, a channel's residual has a kurtosis above `PEAKED_KURTOSIS`;
    False without samples to fit."""
    if any(floor.method == "repeats" for floor in floors):
        return any(
            _is_variation_large(channel) for floor in floors for channel in (floor.response, floor.position) if channel
        )
    masks = [record.fit | record.choose for record in context.full_measure.records]
    residuals = np.vstack([row[mask] for row, mask in zip(explanation.retuned.fitted.residuals, masks, strict=True)])
    if not len(residuals):
        return False
    residuals = residuals - residuals.mean(axis=0)
    power = np.mean(residuals**2, axis=0)
    return bool(np.any(np.mean(residuals**4, axis=0) > PEAKED_KURTOSIS * np.maximum(power, np.finfo(float).tiny) ** 2))


def _is_variation_large(noise: ChannelNoise) -> bool:
    """Whether the variance between the periods of a segment exceeds (IRREGULAR_ERROR rms)² in a channel."""
    return any(bool(np.any(segment.variance > (IRREGULAR_ERROR * noise.rms) ** 2)) for segment in noise.segments)
