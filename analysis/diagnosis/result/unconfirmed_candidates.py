"""Entries of the diagnosis document that need held-out gains: candidates that were not confirmed, and named effects.

The held-out gain is the share of the error power on held-out samples that an effect explains (`held_out_gain`).
"""

from collections.abc import Sequence
from dataclasses import replace

from analysis.diagnosis.confirm.held_out_gain import estimate_held_out_gain
from analysis.diagnosis.document import Candidate, Estimate, NamedEffect
from analysis.diagnosis.errors.error_measure import ErrorMeasure
from analysis.diagnosis.result.findings import BlackBox
from analysis.diagnosis.result.named_effects import extract_law, find_axis_letter, make_labels, report_parameters
from analysis.diagnosis.search.search_context import FittedCandidate
from analysis.diagnosis.search.verdict import UnconfirmedEffect
from equalizer.effects.placing import find_device_part
from equalizer.plant.mechanical_model import MechanicalModel
from equalizer.signals.recording import Recording


def list_unconfirmed_candidates(
    unconfirmed: Sequence[UnconfirmedEffect], black_box: BlackBox | None, recording: Recording, model: MechanicalModel
) -> tuple[Candidate, ...]:
    """List the unconfirmed effects as candidates of the document: of each hypothesis, the claim with index
    `UnconfirmedEffect.claim` (a negative one counts from the end). Empty without unconfirmed effects.

    black_box: the fitted model without physics, for comparison; None where there is none. `share_of_black_box` of a
    candidate is its gain relative to that of the black box or, where a candidate gains more, to the largest gain of a
    candidate. `held_out_gain` and `share_of_black_box` are limited to 1."""
    if not unconfirmed:
        return ()
    labels, largest_gain = (
        make_labels(recording, model),
        max(
            max(unconfirmed_effect.gain for unconfirmed_effect in unconfirmed),
            _compute_black_box_gain(black_box),
            1e-300,
        ),
    )
    candidates = []
    for unconfirmed_effect in unconfirmed:
        claim_index = unconfirmed_effect.claim % len(unconfirmed_effect.hypothesis.claims)
        claim = unconfirmed_effect.hypothesis.claims[claim_index]
        candidates.append(
            Candidate(
                effect=claim.effect.name,
                place=find_device_part(claim.effect),
                axis=find_axis_letter(claim, labels),
                parameters=report_parameters(
                    unconfirmed_effect.hypothesis, claim_index, unconfirmed_effect.hypothesis.point
                ),
                held_out_gain=min(unconfirmed_effect.gain, 1.0),
                share_of_black_box=min(unconfirmed_effect.gain / largest_gain, 1.0),
                why_not=unconfirmed_effect.why_not,
                law=extract_law(unconfirmed_effect.hypothesis, claim_index, find_axis_letter(claim, labels)),
            )
        )
    return tuple(candidates)


def _compute_black_box_gain(black_box: BlackBox | None) -> float:
    """Compute the held-out gain of the black box over the model with the named effects: 1 - (black box error / model
    error)², with the model error `BlackBox.physics_error`; 0 without a black box or where the model error is not
    positive."""
    return (
        0.0
        if black_box is None or not black_box.physics_error > 0
        else 1 - (black_box.test_error / black_box.physics_error) ** 2
    )


def add_held_out_gains(
    effects: Sequence[NamedEffect], measure: ErrorMeasure, fits: Sequence[FittedCandidate]
) -> tuple[NamedEffect, ...]:
    """Add the held-out gains with 95 % intervals, widened to contain the gain, to the effects; None where it cannot be
    estimated. effects: in the order in which the search added them. fits: the fit without effects, then the fit after
    each added effect."""
    effects_with_gain = []
    for index, effect in enumerate(effects):
        gain = estimate_held_out_gain(measure, fits[index], fits[index + 1])
        estimate = (
            None if gain is None else Estimate(gain.gain, "1", (min(gain.low, gain.gain), max(gain.high, gain.gain)))
        )
        effects_with_gain.append(replace(effect, held_out_gain=estimate))
    return tuple(effects_with_gain)
