"""Candidates that a search by simulation found and did not confirm, and held-out gains of the effects that it named.

The held-out gain is the share of the error power on held-out samples that an effect explains (`held_out_gain`).
"""

from collections.abc import Sequence
from dataclasses import replace

from analysis.diagnosis.confirm.held_out_gain import held_out_gain
from analysis.diagnosis.document import Candidate, Estimate, NamedEffect
from analysis.diagnosis.errors.error_measure import ErrorMeasure
from analysis.diagnosis.result.findings import BlackBox
from analysis.diagnosis.result.named_effects import axis_of, labels_of, law_of_claim, report_parameters
from analysis.diagnosis.search.search_context import FittedCandidate
from analysis.diagnosis.search.verdict import Unconfirmed
from equalizer.effects.placing import place_of_effect
from equalizer.plant.mechanical_model import MechanicalModel
from equalizer.signals.recording import Recording


def list_unconfirmed_candidates(
    found: Sequence[Unconfirmed], box: BlackBox | None, recording: Recording, model: MechanicalModel
) -> tuple[Candidate, ...]:
    """The unconfirmed effects as candidates, of each hypothesis the claim with index `Unconfirmed.claim`.
    `share_of_black_box` is relative to the gain of the black box or, where a candidate gains more, to the largest gain
    of the candidates."""
    if not found:
        return ()
    labels, most = labels_of(recording, model), max(max(each.gain for each in found), _gain_of(box), 1e-300)
    candidates = []
    for each in found:
        number = each.claim % len(each.hypothesis.claims)
        claim = each.hypothesis.claims[number]
        candidates.append(
            Candidate(
                effect=claim.effect.name,
                place=place_of_effect(claim.effect),
                axis=axis_of(claim, labels),
                parameters=report_parameters(each.hypothesis, number, each.hypothesis.point),
                held_out_gain=min(each.gain, 1.0),
                share_of_black_box=min(each.gain / most, 1.0),
                why_not=each.why_not,
                law=law_of_claim(each.hypothesis, number, axis_of(claim, labels)),
            )
        )
    return tuple(candidates)


def _gain_of(box: BlackBox | None) -> float:
    """Share of the held-out error power of the model (`BlackBox.physics`) that the black box explains; 0 without a
    black box. The model has no new physics where no effect is named."""
    return 0.0 if box is None or not box.physics > 0 else 1 - (box.test / box.physics) ** 2


def with_gains(
    effects: Sequence[NamedEffect], measure: ErrorMeasure, stages: Sequence[FittedCandidate]
) -> tuple[NamedEffect, ...]:
    """The effects with their held-out gains and 95 % intervals, in the order in which they were found. stages: the fit
    without new physics, then the fit after each effect."""
    named = []
    for place, effect in enumerate(effects):
        gain = held_out_gain(measure, stages[place], stages[place + 1])
        estimate = (
            None if gain is None else Estimate(gain.gain, "1", (min(gain.low, gain.gain), max(gain.high, gain.gain)))
        )
        named.append(replace(effect, held_out_gain=estimate))
    return tuple(named)
