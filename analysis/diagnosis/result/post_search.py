"""Examination of the fits after a search: localisation of the mismatch, curves of the effects, and a black box.

The pieces are independent and computed in parallel; one that crashes is left out and noted (`search.guard`).
"""

from dataclasses import dataclass
from functools import partial

import numpy as np

from analysis.diagnosis.errors.error_measure import ErrorMeasure
from analysis.diagnosis.errors.hypothesis import remove_claim
from analysis.diagnosis.errors.output_error import evaluate_fit, gather_evidence
from analysis.diagnosis.localisation.distortion import Distortions, find_distortions
from analysis.diagnosis.localisation.localisation import Localisation, find_entry_point, find_tied_states
from analysis.diagnosis.localisation.mismatch_maps import Maps
from analysis.diagnosis.noise.noise_floor import NoiseFloor
from analysis.diagnosis.result.black_box import black_box
from analysis.diagnosis.result.curves.signature_curves import Names, signature_of
from analysis.diagnosis.result.error_table import compute_fit_errors
from analysis.diagnosis.result.findings import BlackBox, Signature
from analysis.diagnosis.result.named_effects import make_labels
from analysis.diagnosis.search.explain import Explanation
from analysis.diagnosis.search.guard import Part
from analysis.diagnosis.search.search_context import SearchContext
from analysis.diagnosis.search.verdict import SearchResult
from equalizer.effects.effect import Values
from equalizer.effects.placing import axis_letter
from equalizer.effects.starts.evidence import Evidence

LOCALISATION_NAME = "the localisation"
"""Name of the work in the note of a crash (`guard`)."""


@dataclass(frozen=True, slots=True, eq=False)
class Examination:
    """What is computed from the fits after a search: evidence, localisation, signatures and a black box."""

    evidence: tuple[Evidence, ...]
    """Evidence of the re-tuned model."""
    local: Localisation
    signatures: tuple[Signature, ...]
    """Curve of each named effect: its force over position, velocity or command."""
    black_box: BlackBox | None


def examine_fits(result: SearchResult, floor: NoiseFloor, maps: Maps) -> Examination:
    """Examine the given, the re-tuned and the final model. floor: noise of the first recording. maps: mismatch maps of
    these three stages."""
    context, explanation = result.context, result.found
    measure, tuning, stages = context.whole, context.tuning, explanation.stages
    evidence = gather_evidence(measure, tuning, stages["retuned"])
    entry_search = partial(find_entry_point, measure, tuning, stages["retuned"], floor, maps.cells["retuned"])
    entry = context.guard.run(LOCALISATION_NAME, "its work", entry_search, None)
    # Stages with the same fit are examined once.
    fits = {id(fitted): stage for stage, fitted in stages.items()}
    state_searches = [
        partial(find_tied_states, measure, tuning, stages[stage], maps.cells[stage], entry, retuned_evidence)
        for stage in fits.values()
        for retuned_evidence in [evidence if stages[stage] is stages["retuned"] else ()]
    ]
    parts = [
        *(Part(LOCALISATION_NAME, "its work", work, ()) for work in state_searches),
        Part("the curves of effects", "their making", partial(_signatures, context, explanation), ()),
        Part("the black box", "its fit", partial(_black_box, context, explanation), None),
        Part(
            LOCALISATION_NAME,
            "its work",
            partial(find_distortions, measure.records[0].recording, floor),
            Distortions((), ()),
        ),
    ]
    *state_results, signatures, box, distortions = context.guard.run_parts(context.map_, parts)
    by_fit = dict(zip(fits, state_results, strict=True))
    states = {stage: by_fit[id(fitted)] for stage, fitted in stages.items()}
    return Examination(evidence, Localisation(states, entry, distortions), signatures, box)


def _black_box(context: SearchContext, explanation: Explanation) -> BlackBox | None:
    """A black box with as many terms per channel as the effects have parameters, at least 1, fitted to the residuals of
    the re-tuned model; None where band powers are compared instead of samples."""
    if explanation.statistic is not None:
        return None
    parameters = max(len(explanation.after.fitted.hypothesis.point), 1)
    return black_box(
        context.whole, explanation.retuned, parameters, compute_fit_errors(context.whole, explanation).test.after
    )


def _signatures(context: SearchContext, explanation: Explanation) -> tuple[Signature, ...]:
    """Curve of each named effect: the missing force or residual of the final model without that effect, in the record
    with the most samples to fit or choose by."""
    measure, tuning, fitted = context.whole, context.tuning, explanation.after.fitted
    if not fitted.hypothesis.claims:
        return ()
    record_index = _most_fitted(measure)
    recording = measure.records[record_index].recording
    labels, signatures = make_labels(recording, tuning.model), []
    names = Names(
        tuple(axis_letter(name, labels.inputs) for name in labels.inputs),
        labels.outputs,
        labels.response_unit,
        labels.system,
    )
    complete = gather_evidence(measure, tuning, fitted)[record_index].predicted
    for number in range(len(fitted.hypothesis.claims)):
        remaining = remove_claim(fitted.hypothesis, number)
        evidence = gather_evidence(measure, tuning, evaluate_fit(measure, tuning, fitted.deviations, remaining))
        main = max(fitted.hypothesis.list_effects_of(number), key=lambda placed: _strength(placed.values))
        signatures.append(signature_of(evidence[record_index], complete, main, names, recording.hold))
    return tuple(signatures)


def _most_fitted(measure: ErrorMeasure) -> int:
    """Index of the first record with the most samples to fit or choose by: another record may be held out entirely."""
    return int(np.argmax([np.sum(record.fit | record.choose) for record in measure.records]))


def _strength(values: Values) -> float:
    """Magnitude of the main parameter, which is the first of the values."""
    return abs(next(iter(values.values())))
