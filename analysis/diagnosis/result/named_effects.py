"""Make the named effects of the document: parameters with intervals, rivals with reasons, probabilities.

A reported parameter's 95 % interval is value ± hypot(1.96 s, `INTERVAL_SHARE` value), with the standard error s
propagated from the fit's coordinates. Probabilities of the candidates of a round fall exponentially with their
logarithmic errors.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from analysis.diagnosis.document import Estimate, FoundLaw, NamedEffect, Rival, make_found_law
from analysis.diagnosis.errors.hypothesis import Claim, Hypothesis
from analysis.diagnosis.limits import (
    EXPLAINED_BY_CHANCE,
    INTERVAL_SHARE,
    MOST_RIVALS,
    NO_CANDIDATE_HALFWAY,
    NO_CANDIDATE_HALFWAY_SHARE,
    NO_CANDIDATE_LEAST,
    NO_CANDIDATE_MOST,
    NO_CANDIDATE_STEEPNESS,
    PROBABILITY_SCALE,
)
from analysis.diagnosis.search.explain import Explanation
from analysis.diagnosis.search.parsimony import is_equal_rival, is_refined_candidate
from analysis.diagnosis.search.search_context import FittedCandidate
from analysis.diagnosis.search.verdict import compute_step_shares
from equalizer.effects.discovered_law import Channels, derive_law_units, set_law_values
from equalizer.effects.effect import Effect, Values
from equalizer.effects.placing import find_device_part, shorten_axis_name
from equalizer.plant.effect_vocabulary import EFFECTS_BY_NAME
from equalizer.plant.mechanical_model import MechanicalModel
from equalizer.signals.recording import Recording
from equalizer.signals.signal import FloatArray
from equalizer.signals.unit_system import UnitSystem

BY_CHANCE = "the error by chance alone"
BY_NOISE = "the noise"
"""Units of errors in sentences: the difference between two simulations by chance, or the noise."""

_EQUAL_ERROR_TOLERANCE = 0.005
"""Relative difference of two errors up to which they count as equal. Chosen."""


@dataclass(frozen=True, slots=True, eq=False)
class Labels:
    """Channel names and units for the document."""

    inputs: tuple[str, ...]
    outputs: tuple[str, ...]
    response_unit: str
    system: UnitSystem
    quantity: str = "acceleration"
    """Quantity of the response."""


def make_labels(recording: Recording, model: MechanicalModel) -> Labels:
    """Make the labels: channels of the command and the response, unit of the first response channel, and unit system
    and quantity of the model."""
    unit = recording.response.unit
    return Labels(
        recording.command.channels,
        recording.response.channels,
        unit if isinstance(unit, str) else unit[0],
        model.system,
        model.quantity,
    )


def make_named_effects(explanation: Explanation, errors: FloatArray, labels: Labels) -> tuple[NamedEffect, ...]:
    """Make the effects of the final hypothesis with parameters, rivals and probabilities. errors: (parameters,),
    standard errors of the coordinates of the hypothesis's point (`compute_interval_errors`)."""
    hypothesis, effects, start = explanation.after.fitted.hypothesis, [], 0
    shares = _average_over_rounds(explanation, compute_step_shares(explanation.retuned, explanation.steps))
    for claim_index, claim in enumerate(hypothesis.claims):
        coordinate_count = claim.group_count * sum(not parameter.fixed for parameter in claim.effect.parameters)
        rivals, probability = _list_rivals(explanation, claim_index, labels)
        effects.append(
            NamedEffect(
                effect=claim.effect.name,
                place=find_device_part(claim.effect),
                axis=find_axis_letter(claim, labels),
                share=shares[claim_index],
                probability=probability,
                parameters=_make_estimates(
                    hypothesis, claim_index, errors, slice(start, start + coordinate_count), labels
                ),
                rivals=rivals,
                law=extract_law(hypothesis, claim_index, find_axis_letter(claim, labels)),
            )
        )
        start += coordinate_count
    return tuple(effects)


def _average_over_rounds(explanation: Explanation, shares: Sequence[float]) -> tuple[float, ...]:
    """Average the shares of effects that were added in one round (an antisymmetric pair), whose order is arbitrary."""
    rounds = explanation.rounds[: len(shares)]
    return tuple(float(np.mean([shares[k] for k in range(len(rounds)) if rounds[k] == added])) for added in rounds)


def find_axis_letter(claim: Claim, labels: Labels) -> str | None:
    """Find the axis letter of an effect's site; None where it is at several sites, or can have no single site."""
    if claim.spread != "one" or (claim.effect.sites and "one" not in claim.effect.sites):
        return None
    is_sensor_effect = find_device_part(claim.effect) == "sensor"
    channels = labels.outputs if is_sensor_effect else labels.inputs
    return shorten_axis_name(channels[claim.sites[0]], channels)


def _list_rivals(explanation: Explanation, round_index: int, labels: Labels) -> tuple[tuple[Rival, ...], float]:
    """List the other effects tried in the round of an effect, each once, up to `MOST_RIVALS`; also returns the
    probability of the named effect."""
    fitted_candidates = explanation.rounds[round_index]
    relative_error = (
        explanation.after.score.worst_channel
        if explanation.statistic is None
        else explanation.after.score.worst_channel / EXPLAINED_BY_CHANCE
    )
    remaining_share = 1.0 if explanation.statistic is not None else _compute_remaining_share(explanation)
    candidate_probabilities = compute_probabilities(fitted_candidates, relative_error, remaining_share)
    named, probability_by_name = fitted_candidates[0], _sum_by_name(fitted_candidates, candidate_probabilities)
    rivals: dict[str, Rival] = {}
    unit = BY_NOISE if explanation.statistic is None else BY_CHANCE
    for candidate in fitted_candidates[1:]:
        claim = candidate.fitted.hypothesis.claims[-1]
        if claim.effect.name == named.newest or claim.effect.name in rivals:
            continue
        is_equal = is_equal_rival(named, candidate)
        rivals[claim.effect.name] = Rival(
            claim.effect.name,
            probability_by_name[claim.effect.name],
            is_equal,
            _explain_rejection(named, candidate, is_equal, (labels, unit)),
        )
        if len(rivals) == MOST_RIVALS:
            break
    return tuple(rivals.values()), probability_by_name[named.newest]


def _sum_by_name(
    fitted_candidates: Sequence[FittedCandidate], candidate_probabilities: Sequence[float]
) -> dict[str, float]:
    """Sum the probabilities of each effect name over its candidates at other axes or from other starts, at most 1."""
    probability_by_name: dict[str, float] = {}
    for candidate, probability in zip(fitted_candidates, candidate_probabilities, strict=True):
        name = candidate.newest
        probability_by_name[name] = min(1.0, probability_by_name.get(name, 0.0) + probability)
    return probability_by_name


def _explain_rejection(
    named_candidate: FittedCandidate, rival: FittedCandidate, is_equal: bool, labels_and_unit: tuple[Labels, str]
) -> str:
    """Explain in words why a rival was not chosen. labels_and_unit: labels of the device, and the unit of errors."""
    labels, unit = labels_and_unit
    rival_error, best_error = rival.score.worst_channel, named_candidate.score.worst_channel
    claim = rival.fitted.hypothesis.claims[-1]
    axis = find_axis_letter(claim, labels)
    site = f" ({axis})" if axis else ""
    if is_refined_candidate(rival, named_candidate):
        gain = "too little" if rival_error < (1 - _EQUAL_ERROR_TOLERANCE) * best_error else "nothing"
        return (
            f"it contains the named law as a special case{site}, and its further parameters gain {gain}: its error "
            f"in the worst channel is {rival_error:.3g} times {unit}, that of the named law {best_error:.3g}"
        )
    if is_equal:
        return (
            f"equally good{site}: its error in the worst channel is {rival_error:.2f} times {unit}, that of the named "
            f"effect {best_error:.2f}"
        )
    return (
        f"at its best{site}, its error in the worst channel is {rival_error:.3g} times {unit}, that of the named "
        f"effect {best_error:.3g}"
    )


def _make_estimates(
    hypothesis: Hypothesis, claim_index: int, errors: FloatArray, coordinates: slice, labels: Labels
) -> dict[str, Estimate]:
    """Make the parameters of a claim with units and intervals. The variance of a parameter is the sum of its squared
    changes when each coordinate moves by its standard error; covariances, and coordinates without a finite error, are
    left out. coordinates: the claim's coordinates of the point. Parameters that are not finite are left out."""
    claim = hypothesis.claims[claim_index]
    values = report_parameters(hypothesis, claim_index, hypothesis.point)
    variances = {name: 0.0 for name in values}
    for coordinate in range(coordinates.start, coordinates.stop):
        if not np.isfinite(errors[coordinate]):
            continue
        displaced_point = hypothesis.point.copy()
        displaced_point[coordinate] += errors[coordinate]
        for name, value in report_parameters(hypothesis, claim_index, displaced_point).items():
            variances[name] += (value - values[name]) ** 2
    units = _find_units(claim.effect, values, labels)
    return {
        name: Estimate(value, units.get(name) or "1", _compute_interval(value, float(np.sqrt(variances[name]))))
        for name, value in values.items()
        if np.isfinite(value)
    }


def _find_units(effect: Effect, values: Values, labels: Labels) -> dict[str, str]:
    """Find the unit of each parameter in the model's unit system: by the dimensions of a discovered law, else from the
    vocabulary."""
    if effect.law is not None:
        law = set_law_values(effect.law, values)
        units = derive_law_units(law, Channels(labels.inputs, labels.outputs, labels.quantity), labels.system)
        return dict(zip(values, units, strict=True))
    return {
        parameter.name: parameter.find_unit(labels.system, labels.response_unit)
        for parameter in EFFECTS_BY_NAME[effect.name].parameters
    }


def extract_law(hypothesis: Hypothesis, claim_index: int, axis: str | None) -> FoundLaw | None:
    """Extract the discovered law of a claim, with its fitted parameters, for the document; None for an effect of the
    catalogue. axis: replaces that of the law, unless None."""
    law = hypothesis.claims[claim_index].effect.law
    if law is None:
        return None
    fitted_law = set_law_values(law, _list_group_values(hypothesis, claim_index, hypothesis.point)[0])
    return make_found_law(replace(fitted_law, axis=axis or fitted_law.axis))


def _compute_interval(value: float, standard_error: float) -> tuple[float, float] | None:
    """Compute the 95 % interval of a value (1.96 standard deviations of the normal distribution); None where no
    standard error is known (0, infinite or NaN)."""
    half_width = float(np.hypot(1.96 * standard_error, INTERVAL_SHARE * value)) if standard_error > 0 else 0.0
    return (value - half_width, value + half_width) if np.isfinite(half_width) and half_width > 0 else None


def report_parameters(hypothesis: Hypothesis, claim_index: int, point: FloatArray) -> dict[str, float]:
    """Report the parameters of a claim as the vocabulary defines them: of its first site, or, for an effect in
    `REPORTED_AT_LARGEST`, of the site with the largest main parameter. point: coordinates of the whole hypothesis."""
    group_values = _list_group_values(hypothesis, claim_index, point)
    claim = hypothesis.claims[claim_index]
    reported_values = [dict(claim.effect.report(values)) for values in group_values]
    if claim.effect.name in REPORTED_AT_LARGEST and len(reported_values) > 1:
        main_parameter = EFFECTS_BY_NAME[claim.effect.name].main.name
        return max(reported_values, key=lambda values: abs(values[main_parameter]))
    return reported_values[0]


REPORTED_AT_LARGEST = ("mains_hum", "sensor_drift", "sensor_offset")
"""Effects of which only the channel with the largest main parameter is reported."""


def _list_group_values(hypothesis: Hypothesis, claim_index: int, point: FloatArray) -> Sequence[dict[str, float]]:
    """List the parameters of each group of a claim (one group per site, or one for all), at a point of the
    hypothesis."""
    placed_effects = hypothesis.list_placed_effects(point)
    first_group = sum(claim.group_count for claim in hypothesis.claims[:claim_index])
    return [
        dict(effect.values)
        for effect in placed_effects[first_group : first_group + hypothesis.claims[claim_index].group_count]
    ]


def _compute_remaining_share(explanation: Explanation) -> float:
    """Compute the share of the re-tuned model's excess error over the noise that remains with the effects, each in its
    worst channel; 1 where the re-tuned model has no finite excess."""
    retuned_excess, remaining_excess = (
        max(candidate.score.worst_channel - 1.0, 0.0) for candidate in (explanation.retuned, explanation.after)
    )
    return remaining_excess / retuned_excess if retuned_excess > 0 and np.isfinite(retuned_excess) else 1.0


def compute_probabilities(
    fitted_candidates: Sequence[FittedCandidate], error: float, remaining_share: float = 1.0
) -> tuple[float, ...]:
    """Compute the probability of each candidate of a round: proportional to exp(-excess / PROBABILITY_SCALE), the
    excess being its mean log error above that of the first, preferred candidate (at least 0); 0 for a refinement of the
    first. The sum is 1 - `compute_none_probability(error, remaining_share)`."""
    if not fitted_candidates:
        return ()
    first = fitted_candidates[0]
    excess = np.array(
        [max(candidate.score.mean_log_error - first.score.mean_log_error, 0.0) for candidate in fitted_candidates]
    )
    is_refinement = np.array(
        [candidate is not first and is_refined_candidate(candidate, first) for candidate in fitted_candidates]
    )
    weights = np.where(is_refinement, 0.0, np.exp(-excess / PROBABILITY_SCALE))
    total_probability = 1 - compute_none_probability(error, remaining_share)
    return tuple(total_probability * float(weight) for weight in weights / weights.sum())


def compute_none_probability(error: float, remaining_share: float = 1.0) -> float:
    """Compute the probability that no candidate is right: a logistic function of ln(error - 1), or of the logarithm of
    the remaining share if that gives less, from NO_CANDIDATE_LEAST to NO_CANDIDATE_MOST. A right law of a strong effect
    leaves a small share, which may still be more than noise. error: of the explanation in the worst channel, in units
    of the noise; remaining_share: share of the mismatch that the explanation leaves."""
    excess = min(max(error - 1.0, 0.0) / NO_CANDIDATE_HALFWAY, remaining_share / NO_CANDIDATE_HALFWAY_SHARE)
    odds = excess**NO_CANDIDATE_STEEPNESS
    return float(NO_CANDIDATE_LEAST + (NO_CANDIDATE_MOST - NO_CANDIDATE_LEAST) * odds / (1 + odds))
