"""The named effects for the document: parameters with intervals, rivals with reasons, probabilities.

A reported parameter's 95 % interval is value ± hypot(1.96 s, `INTERVAL_SHARE` value), with the standard error s
propagated from the fit's coordinates. Probabilities of the candidates of a round fall exponentially with their errors.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from analysis.diagnosis.document import Estimate, FoundLaw, NamedEffect, Rival, found_law
from analysis.diagnosis.errors.hypothesis import Claim, Hypothesis
from analysis.diagnosis.search.explain import Explanation
from analysis.diagnosis.search.parsimony import both_stand, only_refines
from analysis.diagnosis.search.search_context import FittedCandidate
from analysis.diagnosis.search.verdict import shares_taken
from analysis.diagnosis.settings import (
    ELSEWHERE_HALFWAY,
    ELSEWHERE_LEAST,
    ELSEWHERE_MOST,
    ELSEWHERE_STEEPNESS,
    EXPLAINED_BY_CHANCE,
    INTERVAL_SHARE,
    MOST_RIVALS,
    PROBABILITY_SCALE,
)
from equalizer.effects.discovered_law import Channels, law_units, law_with_values
from equalizer.effects.effect import Effect, Values
from equalizer.effects.placing import axis_letter, place_of_effect
from equalizer.plant.effect_vocabulary import EFFECTS_BY_NAME
from equalizer.plant.mechanical_model import MechanicalModel
from equalizer.signals.recording import Recording
from equalizer.signals.signal import FloatArray
from equalizer.signals.unit_system import UnitSystem

BY_CHANCE = "the error by chance alone"
BY_NOISE = "the noise"
"""Units of errors in sentences: the difference between two simulations by chance, or the noise."""

_SAME_ERROR = 0.005
"""Relative difference of two errors below which they count as equal."""


@dataclass(frozen=True, slots=True, eq=False)
class Labels:
    """Channel names and units for the document."""

    inputs: tuple[str, ...]
    outputs: tuple[str, ...]
    response_unit: str
    system: UnitSystem
    quantity: str = "acceleration"
    """Quantity of the response."""


def labels_of(recording: Recording, model: MechanicalModel) -> Labels:
    """Channels of the command and the response, unit of the first response channel, and unit system and quantity of the
    model."""
    unit = recording.response.unit
    return Labels(
        recording.command.channels,
        recording.response.channels,
        unit if isinstance(unit, str) else unit[0],
        model.system,
        model.quantity,
    )


def named_effects(found: Explanation, errors: FloatArray, labels: Labels) -> tuple[NamedEffect, ...]:
    """The effects of the final hypothesis with parameters, rivals and probabilities. errors: (parameters,), standard
    errors of the coordinates of the hypothesis's point (`interval_errors`)."""
    whole, named, first = found.after.fitted.hypothesis, [], 0
    shares = shares_taken(found.retuned, found.steps)
    for number, claim in enumerate(whole.claims):
        size = claim.groups * sum(not p.fixed for p in claim.effect.parameters)
        rivals, likely = _rivals(found, number, labels)
        named.append(
            NamedEffect(
                effect=claim.effect.name,
                place=place_of_effect(claim.effect),
                axis=axis_of(claim, labels),
                share=shares[number],
                probability=likely,
                parameters=_estimates(whole, number, errors, slice(first, first + size), labels),
                rivals=rivals,
                law=law_of_claim(whole, number, axis_of(claim, labels)),
            )
        )
        first += size
    return tuple(named)


def axis_of(claim: Claim, labels: Labels) -> str | None:
    """The axis letter of an effect's site; None where all axes share the effect."""
    if claim.spread != "one" or (claim.effect.sites and "one" not in claim.effect.sites):
        return None
    sensed = place_of_effect(claim.effect) == "sensor"
    channels = labels.outputs if sensed else labels.inputs
    return axis_letter(channels[claim.sites[0]], channels)


def _rivals(found: Explanation, number: int, labels: Labels) -> tuple[tuple[Rival, ...], float]:
    """The other effects tried in the round of an effect, each once, up to `MOST_RIVALS`; and the probability of the
    named effect. number: index of the round."""
    fitted_candidates = found.rounds[number]
    left = (
        found.after.score.worst_channel
        if found.statistic is None
        else found.after.score.worst_channel / EXPLAINED_BY_CHANCE
    )
    chances = probabilities(fitted_candidates, left)
    best, by_name = fitted_candidates[0], _chances_of_names(fitted_candidates, chances)
    rivals: dict[str, Rival] = {}
    unit = BY_NOISE if found.statistic is None else BY_CHANCE
    for other in fitted_candidates[1:]:
        claim = other.fitted.hypothesis.claims[-1]
        if claim.effect.name == best.newest or claim.effect.name in rivals:
            continue
        same = both_stand(best, other)
        rivals[claim.effect.name] = Rival(
            claim.effect.name, by_name[claim.effect.name], same, _why_not(best, other, same, (labels, unit))
        )
        if len(rivals) == MOST_RIVALS:
            break
    return tuple(rivals.values()), by_name[best.newest]


def _chances_of_names(fitted_candidates: Sequence[FittedCandidate], chances: Sequence[float]) -> dict[str, float]:
    """Probability of each effect name, summed over its candidates at other axes or from other starts."""
    found: dict[str, float] = {}
    for candidate, chance in zip(fitted_candidates, chances, strict=True):
        name = candidate.newest
        found[name] = min(1.0, found.get(name, 0.0) + chance)
    return found


def _why_not(best: FittedCandidate, other: FittedCandidate, same: bool, words: tuple[Labels, str]) -> str:
    """Reason for not choosing a rival. words: labels of the device, and the unit of errors."""
    labels, unit = words
    worst, least = other.score.worst_channel, best.score.worst_channel
    claim = other.fitted.hypothesis.claims[-1]
    axis = axis_of(claim, labels)
    where = f" ({axis})" if axis else ""
    if only_refines(other, best):
        gain = "too little" if worst < (1 - _SAME_ERROR) * least else "nothing"
        return (
            f"it contains the named law as a special case{where}, and its further parameters gain {gain}: its error "
            f"in the worst channel is {worst:.3g} times {unit}, that of the named law {least:.3g}"
        )
    if same:
        return (
            f"equally good{where}: its error in the worst channel is {worst:.2f} times {unit}, that of the named "
            f"effect {least:.2f}"
        )
    return (
        f"at its best{where}, its error in the worst channel is {worst:.3g} times {unit}, that of the named effect "
        f"{least:.3g}"
    )


def _estimates(whole: Hypothesis, number: int, errors: FloatArray, own: slice, labels: Labels) -> dict[str, Estimate]:
    """Parameters of a claim with units and intervals. The variance of a parameter is the sum of its squared changes
    when each coordinate moves by its standard error; covariances are left out. own: the claim's coordinates of the
    point."""
    claim = whole.claims[number]
    at = report_parameters(whole, number, whole.point)
    spread = {name: 0.0 for name in at}
    for coordinate in range(own.start, own.stop):
        if not np.isfinite(errors[coordinate]):
            continue
        moved = whole.point.copy()
        moved[coordinate] += errors[coordinate]
        for name, value in report_parameters(whole, number, moved).items():
            spread[name] += (value - at[name]) ** 2
    units = _units(claim.effect, at, labels)
    return {
        name: Estimate(value, units.get(name) or "1", _interval(value, float(np.sqrt(spread[name]))))
        for name, value in at.items()
        if np.isfinite(value)
    }


def _units(effect: Effect, values: Values, labels: Labels) -> dict[str, str]:
    """Units by parameter, in the model's unit system: of a discovered law by its dimensions, else of the vocabulary."""
    if effect.law is not None:
        law = law_with_values(effect.law, values)
        units = law_units(law, Channels(labels.inputs, labels.outputs, labels.quantity), labels.system)
        return dict(zip(values, units, strict=True))
    return {p.name: p.unit_in(labels.system, labels.response_unit) for p in EFFECTS_BY_NAME[effect.name].parameters}


def law_of_claim(whole: Hypothesis, number: int, axis: str | None) -> FoundLaw | None:
    """The discovered law of a claim, with its fitted parameters, as the document writes it; None for an effect of the
    catalogue. axis: replaces that of the law."""
    law = whole.claims[number].effect.law
    if law is None:
        return None
    found = law_with_values(law, _groups(whole, number, whole.point)[0])
    return found_law(replace(found, axis=axis or found.axis))


def _interval(value: float, standard_error: float) -> tuple[float, float] | None:
    """The 95 % interval of a value; None where no standard error is known (0 or infinite)."""
    reach = float(np.hypot(1.96 * standard_error, INTERVAL_SHARE * value)) if standard_error > 0 else 0.0
    return (value - reach, value + reach) if np.isfinite(reach) and reach > 0 else None


def report_parameters(whole: Hypothesis, number: int, point: FloatArray) -> dict[str, float]:
    """Parameters of a claim as the vocabulary defines them: of its first site, or, for an effect in `LARGEST`, of the
    site with the largest main parameter. point: coordinates of the whole hypothesis."""
    groups = _groups(whole, number, point)
    claim = whole.claims[number]
    reported = [dict(claim.effect.report(values)) for values in groups]
    if claim.effect.name in LARGEST and len(reported) > 1:
        main = EFFECTS_BY_NAME[claim.effect.name].main.name
        return max(reported, key=lambda values: abs(values[main]))
    return reported[0]


LARGEST = ("mains_hum", "sensor_drift", "sensor_offset")
"""Effects of which only the channel with the largest main parameter is reported."""


def _groups(whole: Hypothesis, number: int, point: FloatArray) -> Sequence[dict[str, float]]:
    """Parameters of each group of a claim (one group per site, or one for all), at a point of the hypothesis."""
    placed = whole.list_placed_effects(point)
    first = sum(claim.groups for claim in whole.claims[:number])
    return [dict(effect.values) for effect in placed[first : first + whole.claims[number].groups]]


def probabilities(fitted_candidates: Sequence[FittedCandidate], left: float) -> tuple[float, ...]:
    """Probability of each candidate of a round: proportional to exp(-excess / PROBABILITY_SCALE), the excess being its
    mean log error above that of the first, preferred candidate (at least 0); 0 for a refinement of the first. The sum
    is 1 - `probability_of_none(left)`."""
    if not fitted_candidates:
        return ()
    best = fitted_candidates[0]
    behind = np.array(
        [max(candidate.score.mean_log_error - best.score.mean_log_error, 0.0) for candidate in fitted_candidates]
    )
    refines = np.array([candidate is not best and only_refines(candidate, best) for candidate in fitted_candidates])
    weights = np.where(refines, 0.0, np.exp(-behind / PROBABILITY_SCALE))
    return tuple((1 - probability_of_none(left)) * float(weight) for weight in weights / weights.sum())


def probability_of_none(left: float) -> float:
    """Probability that no candidate is right: a logistic function of ln(left - 1), from ELSEWHERE_LEAST to
    ELSEWHERE_MOST. left: error of the whole explanation in the worst channel, in units of the noise."""
    odds = (max(left - 1.0, 0.0) / ELSEWHERE_HALFWAY) ** ELSEWHERE_STEEPNESS
    return float(ELSEWHERE_LEAST + (ELSEWHERE_MOST - ELSEWHERE_LEAST) * odds / (1 + odds))
