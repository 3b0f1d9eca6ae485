"""Examination of the fits after a search: localisation of the mismatch, curves of the effects, and a black-box model.

First the entry point of the mismatch is located; then its dependence on the state, the effects' curves, the black box
and the distortion are computed in parallel. A part that crashes is left out with a remark where the guard is enabled
(`search.guard`).
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np

from analysis.diagnosis.errors.error_measure import ErrorMeasure
from analysis.diagnosis.errors.hypothesis import remove_claim
from analysis.diagnosis.errors.output_error import evaluate_fit, gather_evidence
from analysis.diagnosis.localisation.distortion import Distortions, find_distortions
from analysis.diagnosis.localisation.localisation import Localisation, find_entry_point, find_state_dependences
from analysis.diagnosis.localisation.mismatch_maps import MismatchMaps
from analysis.diagnosis.noise.noise_floor import NoiseFloor
from analysis.diagnosis.result.black_box import fit_black_box
from analysis.diagnosis.result.curves.signature_curves import CurveNames, compute_signature
from analysis.diagnosis.result.error_table import compute_fit_errors
from analysis.diagnosis.result.findings import BlackBox, Signature
from analysis.diagnosis.result.named_effects import make_labels
from analysis.diagnosis.search.explain import Explanation
from analysis.diagnosis.search.guard import WorkPart
from analysis.diagnosis.search.search_context import SearchContext
from analysis.diagnosis.search.verdict import SearchResult
from equalizer.effects.placing import shorten_axis_name
from equalizer.effects.starts.evidence import Evidence

LOCALISATION_NAME = "the localisation"
"""Name of the part in the remark on a crash (`search.guard`)."""


@dataclass(frozen=True, slots=True, eq=False)
class Examination:
    """Localisation of the mismatch, curves of the named effects and black-box model, computed after a search."""

    evidence: tuple[Evidence, ...]
    """Residuals and motion under the re-tuned model, one entry per record."""
    localisation: Localisation
    """Entry point, dependence on the state, and distortion of the mismatch."""
    signatures: tuple[Signature, ...]
    """Curve of each named effect, such as its force over position, velocity or command."""
    black_box: BlackBox | None
    """Fitted to the residuals of the re-tuned model; None where band powers were compared, no error on held-out
    data is known, or its fit crashed."""


def examine_fits(search_result: SearchResult, floors: Sequence[NoiseFloor], maps: MismatchMaps) -> Examination:
    """Localise the mismatch of the given, the re-tuned and the final model, and compute the curves of the named
    effects. floors: noise of each record. maps: mismatch maps of these three stages."""
    context, explanation = search_result.context, search_result.found
    measure, tuning, stages = context.full_measure, context.tuning, explanation.stages
    evidence = gather_evidence(measure, tuning, stages["retuned"])
    entry_search = partial(find_entry_point, measure, tuning, stages["retuned"], floors, maps.cells["retuned"])
    entry_point = context.guard.run(LOCALISATION_NAME, "its work", entry_search, None)
    # Stages with the same fit are examined once.
    stage_by_fit = {id(fitted): stage for stage, fitted in stages.items()}
    state_searches = [
        partial(
            find_state_dependences, measure, tuning, stages[stage], maps.cells[stage], entry_point, retuned_evidence
        )
        for stage in stage_by_fit.values()
        for retuned_evidence in [evidence if stages[stage] is stages["retuned"] else ()]
    ]
    work_parts = [
        *(WorkPart(LOCALISATION_NAME, "its work", state_search, ()) for state_search in state_searches),
        WorkPart("the curves of effects", "their making", partial(_compute_signatures, context, explanation), ()),
        WorkPart("the black box", "its fit", partial(_fit_black_box, context, explanation), None),
        WorkPart(
            LOCALISATION_NAME,
            "its work",
            partial(find_distortions, [record.recording for record in measure.records], floors),
            Distortions((), ()),
        ),
    ]
    *state_results, signatures, black_box, distortions = context.guard.run_parts(context.map_, work_parts)
    states_by_fit = dict(zip(stage_by_fit, state_results, strict=True))
    states = {stage: states_by_fit[id(fitted)] for stage, fitted in stages.items()}
    return Examination(evidence, Localisation(states, entry_point, distortions), signatures, black_box)


def _fit_black_box(context: SearchContext, explanation: Explanation) -> BlackBox | None:
    """Fit a black-box model to the residuals of the re-tuned model, with as many terms per channel as the effects have
    parameters, at least 1; None where band powers are compared instead of samples, or no error on held-out data is
    known."""
    if explanation.statistic is not None:
        return None
    parameter_count = max(len(explanation.after.fitted.hypothesis.point), 1)
    return fit_black_box(
        context.full_measure,
        explanation.retuned,
        parameter_count,
        compute_fit_errors(context.full_measure, explanation).test.after,
    )


def _compute_signatures(context: SearchContext, explanation: Explanation) -> tuple[Signature, ...]:
    """Compute the curve of each named effect: the missing force or residual of the final model without that effect, in
    the record of `_find_main_record`; empty without named effects. Of an effect with parameters per axis, the axis with
    the largest main parameter is shown."""
    measure, tuning, fitted = context.full_measure, context.tuning, explanation.after.fitted
    if not fitted.hypothesis.claims:
        return ()
    record_index = _find_main_record(measure)
    recording = measure.records[record_index].recording
    labels, signatures = make_labels(recording, tuning.model), []
    curve_names = CurveNames(
        tuple(shorten_axis_name(name, labels.inputs) for name in labels.inputs),
        labels.outputs,
        labels.response_unit,
        labels.system,
    )
    full_prediction = gather_evidence(measure, tuning, fitted)[record_index].predicted
    for effect_index in range(len(fitted.hypothesis.claims)):
        reduced_hypothesis = remove_claim(fitted.hypothesis, effect_index)
        evidence = gather_evidence(
            measure, tuning, evaluate_fit(measure, tuning, fitted.deviations, reduced_hypothesis)
        )
        main_effect = max(
            fitted.hypothesis.list_effects_of(effect_index),
            key=lambda placed_effect: abs(next(iter(placed_effect.values.values()))),
        )
        signatures.append(
            compute_signature(evidence[record_index], full_prediction, main_effect, curve_names, recording.hold)
        )
    return tuple(signatures)


def _find_main_record(measure: ErrorMeasure) -> int:
    """Find the index of the record with the most samples for the fit or the choice of effects, the first of equals;
    other records may be held out entirely."""
    return int(np.argmax([np.sum(record.fit | record.choose) for record in measure.records]))
