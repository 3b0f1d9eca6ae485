"""Rattling play: its waveform is chaotic and cannot be predicted, so hypotheses are compared by band powers.

Two simulations of a drive with play diverge within a few impacts, however small their initial difference (Ott, Chaos in
Dynamical Systems, chapter 4). So the difference between two simulations of one hypothesis takes the place of the noise.

Where play alone leaves more than chance, a fault of the sensor is looked for beside it: its starting values come from
the readings themselves (a line, repeats, a step, a limit), which need no prediction of the waveform.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from analysis.diagnosis.errors.band_power import BandPower
from analysis.diagnosis.errors.band_power_fit import BandPowerFit, View, evaluate_hypothesis, fit_band_power, perturb
from analysis.diagnosis.errors.excited_segments import select_excited_segments
from analysis.diagnosis.errors.fit_score import FitScore
from analysis.diagnosis.errors.free_simulation import FreeSimulation
from analysis.diagnosis.errors.hypothesis import (
    NOTHING,
    Claim,
    Hypothesis,
    combine,
    hypothesis_of_claim,
    without_claim,
)
from analysis.diagnosis.errors.output_error import evaluate_fit, expected_gain, gather_evidence
from analysis.diagnosis.noise.channel_noise import ChannelNoise
from analysis.diagnosis.noise.noise_floor import NoiseFloor
from analysis.diagnosis.search.explain import Explanation, Statistic
from analysis.diagnosis.search.identifiability import open_effects
from analysis.diagnosis.search.search_context import STARTING, FittedCandidate, SearchContext
from analysis.diagnosis.search.starting_hypotheses import candidates
from analysis.diagnosis.settings import (
    EXPLAINED_BY_CHANCE,
    IMPACTS_AS_GOOD,
    IMPACTS_ERROR,
    IMPACTS_LEAST_SPREAD,
    IMPACTS_SHARE,
    PEAKED_KURTOSIS,
    VARIES_ERROR,
)
from equalizer.effects.effect import Effect, Values
from equalizer.effects.placing import place_of_effect
from equalizer.effects.starts.evidence import Evidence
from equalizer.signals.signal import FloatArray

WORDS = "band power of the response"
SIMULATIONS = 4
"""Simulations of one hypothesis: their spread is the chance variation, their mean is compared by the last fit."""
WIDTHS = np.geomspace(0.02, 5.0, 13)
"""Gaps that are tried, over the estimated one."""
FIRST_ROUNDS, ROUNDS, STEPS = 5, 4, 2
"""Steps of the first fit, without the model's parameters; linearisations of the last fit; and its steps for each."""
GAINED = 0.02
"""Relative decrease of the cost that a further linearisation must promise."""
RIVAL = "loose_joint"


def explain_impacts(
    context: SearchContext, found: Explanation, floors: Sequence[NoiseFloor], catalogue: Sequence[Effect]
) -> Explanation | None:
    """The explanation by play, compared by band power; None where the response is regular, or play does not explain
    it."""
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
    best = _refine(view, places[0])
    others = list(places[1:])
    if RIVAL in effects:
        others.append(_fit_claim(view, evidence, Claim(effects[RIVAL], "one", best.hypothesis.claims[0].sites)))
    fits = _with_sensor_fault(context, view, best, [e for e in catalogue if place_of_effect(e) == "sensor"])
    named = _judge(context, found, fits, [rival.hypothesis for rival in others if _is_model(rival)])
    # Where the gap may be zero, something else makes the response irregular.
    if named is None or any(open_effects(context, named)) or not _needs_gap(context, view, fits[-1]):
        return None
    return named


def _with_sensor_fault(
    context: SearchContext, view: View, alone: BandPowerFit, faults: Sequence[Effect]
) -> tuple[BandPowerFit, ...]:
    """The fit of play, and where it leaves more than chance, that of play with the sensor fault that lowers the cost
    most, if this takes most of what is left."""
    comparison = _comparison(context, alone)
    before = comparison.score_candidate(alone.deviations, alone.hypothesis)
    if _worst_part(before) <= EXPLAINED_BY_CHANCE:
        return (alone,)
    played = evaluate_fit(context.measure, context.tuning, alone.deviations, alone.hypothesis)
    evidence = gather_evidence(context.measure, context.tuning, played)[0]
    tried = [
        evaluate_hypothesis(view, alone.deviations, combine(alone.hypothesis, fault))
        for fault in candidates(faults, evidence, context.guard.over(context.map_, STARTING))
    ]
    if not tried:
        return (alone,)
    both = _refine(view, min(tried, key=lambda trial: trial.cost))
    after = comparison.score_candidate(both.deviations, both.hypothesis)
    return (alone, both) if _worst_part(after) <= (1 - IMPACTS_SHARE) * _worst_part(before) else (alone,)


def _worst_part(candidate: FittedCandidate) -> float:
    """The larger misfit over chance of the samples to choose by and to test, each the root mean square of channels."""
    parts = (candidate.score.choose, candidate.score.test)
    return max((_rms_over_channels(part) for part in parts if np.isfinite(part).any()), default=0.0)


def _needs_gap(context: SearchContext, view: View, best: BandPowerFit) -> bool:
    """Whether two bodies that touch without a gap, refitted, leave far more: the profile of the gap at zero."""
    claim, placed = best.hypothesis.claims[0], best.hypothesis.placed_effects()[0]
    free = claim.effect.parameters
    closed = replace(claim.effect, parameters=tuple(replace(p, fixed=p.fixed or p.name == "gap") for p in free))
    gap = next(p.lower for p in free if p.name == "gap")
    hypothesis = combine(
        hypothesis_of_claim(replace(claim, effect=closed), [{**placed.values, "gap": gap}]),
        without_claim(best.hypothesis, 0),
    )
    without = fit_band_power(view, evaluate_hypothesis(view, best.deviations, hypothesis), FIRST_ROUNDS)
    if not np.isfinite(without.cost):
        return False
    comparison = _comparison(context, best)
    each = [comparison.score_candidate(fitted.deviations, fitted.hypothesis) for fitted in (best, without)]
    return _is_convincing(*each)


def _fit_claim(view: View, evidence: Evidence, claim: Claim) -> BandPowerFit:
    """The best fit of a claim, on the segments that excite its axis."""
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


def _is_model(trial: BandPowerFit) -> bool:
    return bool(trial.hypothesis.claims) and bool(np.isfinite(trial.cost))


def _refine(view: View, start: BandPowerFit) -> BandPowerFit:
    """The fit of the hypothesis's and the model's parameters together: play changes the sensitivity to the model's."""
    view = _with_chance(view, start)
    best = evaluate_hypothesis(view, start.deviations, start.hypothesis)
    before = 0.0
    for _ in range(ROUNDS):
        view = replace(view, by_deviations=_by_deviations(view, best))
        better = fit_band_power(view, best, STEPS)
        gained = 1 - better.cost / best.cost if best.cost > 0 else 0.0
        best, expected, before = better, expected_gain(gained, before), gained
        if expected <= GAINED:
            break
    return best


def _with_chance(view: View, at: BandPowerFit) -> View:
    """The view with each band's chance variation between simulations, and averaging over as many."""

    def predict(number: int) -> FloatArray:
        return view.predict(at.deviations, perturb(at.hypothesis, number))

    spread = np.std(np.array(list(view.map_(predict, range(SIMULATIONS)))), axis=0, ddof=1)
    return replace(view, spread=spread, ensemble=SIMULATIONS)


def _by_deviations(view: View, at: BandPowerFit) -> FloatArray:
    """(t, stretches, bands, c): sensitivity by forward differences of one standard deviation, large against chance."""
    ways = np.eye(len(at.deviations))

    def moved(number: int) -> FloatArray:
        change = view.predict(at.deviations + ways[number], at.hypothesis) - at.predicted
        return np.where(np.isfinite(change), change, 0.0)

    return np.array(list(view.map_(moved, range(len(ways)))))


@dataclass(frozen=True, slots=True, eq=False)
class _Comparison:
    """Compares candidates by band power on all samples, held-out ones included."""

    context: SearchContext
    power: BandPower
    chance: FloatArray
    """(c,)"""

    def score_candidate(self, deviations: FloatArray, hypothesis: Hypothesis) -> FittedCandidate:
        whole = evaluate_fit(self.context.whole, self.context.tuning, deviations, hypothesis)
        off = self.power.misfits(self.power.measured - self.power.predict(whole.residuals))
        return FittedCandidate(whole, FitScore(*(self._times(misfit) for misfit in (off.fit, off.choose, off.test))))

    def _times(self, off: FloatArray) -> FloatArray:
        """Misfit over chance; 1 for a channel whose bands are all below the noise."""
        return off if np.isnan(off).all() else np.where(np.isnan(off), 1.0, off / self.chance)


def _judge(
    context: SearchContext, found: Explanation, fits: Sequence[BandPowerFit], others: Sequence[Hypothesis]
) -> Explanation | None:
    """The explanation by play, and by a sensor fault beside it where there is one; None where the re-tuned model or a
    rival of play is as good. fits: of one more effect each."""
    best = fits[-1]
    comparison = _comparison(context, best)
    steps = tuple(comparison.score_candidate(each.deviations, each.hypothesis) for each in fits)
    named = steps[-1]
    given = np.zeros_like(best.deviations)
    before = comparison.score_candidate(given, NOTHING)
    linear = [
        before,
        *(comparison.score_candidate(at, NOTHING) for at in (found.retuned.fitted.deviations, best.deviations)),
    ]
    retuned = min(linear, key=lambda candidate: candidate.score.mean_log_error)
    rivals = [comparison.score_candidate(given, rival) for rival in others]
    earlier = (*(found.rounds[0] if found.rounds else ()), *found.steps[1:])
    rivals += [
        comparison.score_candidate(candidate.fitted.deviations, candidate.fitted.hypothesis)
        for candidate in earlier
        if candidate.fitted.hypothesis.key[-1] != fits[0].hypothesis.key[-1]
    ]
    rivals.sort(key=lambda rival: rival.score.mean_log_error)
    if not _is_convincing(named, retuned) or any(_as_good(rival, named) for rival in rivals):
        return None
    statistic = Statistic(WORDS, comparison.chance, best.errors)
    rounds = ((steps[0], *rivals), *((step,) for step in steps[1:]))
    return Explanation(before, retuned, named, rounds, steps, statistic)


def _comparison(context: SearchContext, best: BandPowerFit) -> _Comparison:
    power, model = BandPower(context.whole), context.tuning.tune(best.deviations)

    def predict(number: int) -> FloatArray:
        return power.predict(context.whole.residuals(model, perturb(best.hypothesis, number).placed_effects()))

    first, other = (np.asarray(each) for each in context.map_(predict, range(2)))
    differ = power.misfits(first - other)
    chance = np.fmax(np.fmax(differ.fit, differ.choose), differ.test)
    return _Comparison(context, power, np.fmax(chance, IMPACTS_LEAST_SPREAD))


def _is_convincing(named: FittedCandidate, retuned: FittedCandidate) -> bool:
    pairs = [
        (getattr(retuned.score, part), getattr(named.score, part))
        for part in ("choose", "test")
        if np.isfinite(getattr(named.score, part)).any()
    ]
    return all(
        _rms_over_channels(left) <= (1 - IMPACTS_SHARE) * _rms_over_channels(of)
        and _rms_over_channels(left) <= IMPACTS_ERROR
        for of, left in pairs
    )


def _as_good(rival: FittedCandidate, named: FittedCandidate) -> bool:
    ways = [(getattr(candidate.score, part) for candidate in (rival, named)) for part in ("choose", "test")]
    return all(
        _rms_over_channels(other) <= IMPACTS_AS_GOOD * _rms_over_channels(own)
        for other, own in ways
        if np.isfinite(other).any()
    )


def _rms_over_channels(times: FloatArray) -> float:
    """Root mean square over the channels."""
    return float(np.sqrt(np.nanmean(times**2)))


# A response is irregular where repeats differ by far more than the noise or, without repeats, its residual is peaked.
def is_irregular(context: SearchContext, found: Explanation, floors: Sequence[NoiseFloor]) -> bool:
    """Whether a response is irregular, as of rattling play: its periods vary by far more than the noise or, without
    repeats, a channel's residual has a kurtosis above `PEAKED_KURTOSIS`."""
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
    return any(bool(np.any(segment.variance > (VARIES_ERROR * noise.rms) ** 2)) for segment in noise.segments)
