"""Candidates that a search by simulation found and did not confirm, and held-out gains of the effects that it named.

The held-out gain is the share of the error power on held-out samples that an effect explains (`held_out_gain`).
"""

from collections.abc import Sequence
from dataclasses import replace

from analysis.diagnosis.confirm.held_out_gain import held_out_gain
from analysis.diagnosis.document import Candidate, Estimate, NamedEffect
from analysis.diagnosis.errors.error_measure import ErrorMeasure
from analysis.diagnosis.result.findings import BlackBox
from analysis.diagnosis.result.named_effects import extract_law, find_axis_letter, make_labels, report_parameters
from analysis.diagnosis.search.search_context import FittedCandidate
from analysis.diagnosis.search.verdict import Unconfirmed
from equalizer.effects.placing import place_of_effect
from equalizer.plant.mechanical_model import MechanicalModel
from equalizer.signals.recording import Recording


def list_unconfirmed_candidates(
    unconfirmed: Sequence[Unconfirmed], black_box: BlackBox | None, recording: Recording, model: MechanicalModel
) -> tuple[Candidate, ...]:
    """Candidates for the result: of each unconfirmed hypothesis the claim with index `Unconfirmed.claim`.
    `share_of_black_box` is relative to the gain of the black box or, where a candidate gains more, to the largest gain
    of the candidates."""
    if not unconfirmed:
        return ()
    labels, largest_gain = (
        make_labels(recording, model),
        max(max(entry.gain for entry in unconfirmed), _compute_gain(black_box), 1e-300),
    )
    candidates = []
    for entry in unconfirmed:
        claim_index = entry.claim % len(entry.hypothesis.claims)
        claim = entry.hypothesis.claims[claim_index]
        candidates.append(
            Candidate(
                effect=claim.effect.name,
                place=place_of_effect(claim.effect),
                axis=find_axis_letter(claim, labels),
                parameters=report_parameters(entry.hypothesis, claim_index, entry.hypothesis.point),
                held_out_gain=min(entry.gain, 1.0),
                share_of_black_box=min(entry.gain / largest_gain, 1.0),
                why_not=entry.why_not,
                law=extract_law(entry.hypothesis, claim_index, find_axis_letter(claim, labels)),
            )
        )
    return tuple(candidates)


def _compute_gain(black_box: BlackBox | None) -> float:
    """Held-out gain of the black box: 1 - (black box error / model error)², with `BlackBox.physics_error` as the
    model error; that model has no new physics where no effect is named; 0 without a black box."""
    return (
        0.0
        if black_box is None or not black_box.physics_error > 0
        else 1 - (black_box.test_error / black_box.physics_error) ** 2
    )


def add_held_out_gains(
    effects: Sequence[NamedEffect], measure: ErrorMeasure, stages: Sequence[FittedCandidate]
) -> tuple[NamedEffect, ...]:
    """The effects with their held-out gains and 95 % intervals, in the order in which they were found. stages: the fit
    without new physics, then the fit after each effect."""
    with_gain = []
    for index, effect in enumerate(effects):
        gain = held_out_gain(measure, stages[index], stages[index + 1])
        estimate = (
            None if gain is None else Estimate(gain.gain, "1", (min(gain.low, gain.gain), max(gain.high, gain.gain)))
        )
        with_gain.append(replace(effect, held_out_gain=estimate))
    return tuple(with_gain)
