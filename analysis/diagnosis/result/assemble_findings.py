"""Assemble the findings of a finished search: the document (`Diagnosis`), and the data of figures and sentences.

In this order: labels and re-tuned models, standard errors, mismatch maps of the given, re-tuned and completed model,
examination of the fits (`examine_fits`), choice of the next recording, document.
"""

from collections import Counter
from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from analysis.diagnosis.data.measured_motion import is_quasi_static
from analysis.diagnosis.data.recorded_conditions import adapt_to_recorded_commands
from analysis.diagnosis.document import Diagnosis, Mismatch, NamedEffect
from analysis.diagnosis.errors.error_measure import ErrorMeasure
from analysis.diagnosis.errors.error_measure_rule import IN_SAMPLES
from analysis.diagnosis.errors.tuning import Tuning
from analysis.diagnosis.limits import EXPLAINED_BY_CHANCE, INTERVAL_FACTOR
from analysis.diagnosis.localisation.localisation import Localisation
from analysis.diagnosis.localisation.mismatch_maps import MismatchMaps, build_mismatch_maps, summarise_worst_channel
from analysis.diagnosis.localisation.mismatch_rows import list_mismatch_rows
from analysis.diagnosis.localisation.model_error_floor import ModelErrorFloor, describe_model_error_floor
from analysis.diagnosis.noise.noise_floor import NoiseFloor
from analysis.diagnosis.result.error_table import (
    collect_channel_errors,
    compute_fit_errors,
    find_resting_channels,
    is_held_out_still,
)
from analysis.diagnosis.result.examine_fits import examine_fits
from analysis.diagnosis.result.findings import Findings, TimeSeries
from analysis.diagnosis.result.named_effects import Labels, make_labels, make_named_effects
from analysis.diagnosis.result.unconfirmed_candidates import add_held_out_gains
from analysis.diagnosis.result.unit_doubt import describe_measured_doubts, describe_unknown_units
from analysis.diagnosis.search.explain import Explanation
from analysis.diagnosis.search.identifiability import compute_final_errors, compute_interval_errors
from analysis.diagnosis.search.search_context import SearchContext
from analysis.diagnosis.search.verdict import Judgement, SearchResult
from analysis.wording import conjoin
from equalizer.effects.placing import convert_to_model_effects, shorten_axis_name
from equalizer.plant.mechanical_model import MechanicalModel
from equalizer.signals.recording import Recording
from equalizer.signals.signal import FloatArray, find_runs

if TYPE_CHECKING:
    from analysis.diagnosis.next_experiment.propose_experiment import Proposal


def assemble_findings(
    result: SearchResult, floors: tuple[NoiseFloor, ...], names: Sequence[str], learned: ModelErrorFloor
) -> Findings:
    """Assemble the findings of a search. result.found.after: the model with the named effects, or the re-tuned model
    without any. floors: noise of each record. names: of the records (`name_parts`). learned: the residual of clean
    recordings, counted as noise."""
    context, fits, verdict = result.context, result.found, result.judgement
    measure, tuning = context.full_measure, context.tuning
    recording, placed_effects = measure.records[0].recording, fits.after.fitted.hypothesis.list_placed_effects()
    labels, (improved, retuned) = make_labels(recording, tuning.model), _build_models(result, recording)
    channels, errors = list_channel_names(recording, len(measure.noise)), _compute_standard_errors(result)
    maps = build_mismatch_maps(measure, fits.stages, floors, learned, context.map_)
    time_series = _build_time_series(measure, fits, names)
    examination = examine_fits(result, floors, maps)
    in_samples = "" if recording.is_timed or is_quasi_static(recording) else IN_SAMPLES
    proposal = context.guard.run("the next recording", "its choice", partial(_propose, context, fits, verdict), None)
    unit_doubts = describe_measured_doubts(measure, tuning.model, floors, time_series)
    measure_remarks = (_describe_rest(measure, channels), describe_model_error_floor(learned, channels), in_samples)
    return Findings(
        diagnosis=_build_document(result, errors, (maps, examination.localisation), proposal),
        explanation=fits,
        given=tuning.model,
        improved=improved,
        retuned=retuned,
        named=placed_effects,
        evidence=examination.evidence,
        time_series=time_series,
        noise_rms=dict(zip(channels, measure.noise.tolist(), strict=True)),
        channel_errors=collect_channel_errors(fits, channels),
        mismatch=maps.rows,
        is_timed=recording.is_timed,
        signatures=examination.signatures,
        black_box=examination.black_box,
        remarks=_collect_remarks((measure_remarks, unit_doubts), tuning, floors),
        maps=maps.cells,
        localisation=examination.localisation,
        floor=floors[0],
        tuning=tuning,
        axes=tuple(shorten_axis_name(name, labels.inputs) for name in labels.inputs),
        proposal=proposal,
        split_s=_measure_split_s(measure),
        own_errors=errors[: len(tuning.names)] * tuning.deviation,
    )


def _build_models(result: SearchResult, recording: Recording) -> tuple[MechanicalModel, MechanicalModel]:
    """Build the re-tuned models with the named effects and without, driven by the commands as they were recorded."""
    tuning, explanation = result.context.tuning, result.found
    fitted, labels = explanation.after.fitted, make_labels(recording, tuning.model)
    effects = (
        *tuning.model.effects,
        *convert_to_model_effects(fitted.hypothesis.list_placed_effects(), labels.inputs, labels.outputs),
    )
    completed = replace(tuning.tune(fitted.deviations), effects=effects)
    return adapt_to_recorded_commands(completed, recording), adapt_to_recorded_commands(
        tuning.tune(explanation.retuned.fitted.deviations), recording
    )


def _describe_rest(measure: ErrorMeasure, channels: Sequence[str]) -> str:
    """Describe in a sentence that the held-out samples contain no motion, or none of some channels; empty where all
    move. channels: names."""
    if is_held_out_still(measure.records, measure.noise):
        return (
            "The held-out data contain no motion, so no error on them is stated. Give a stretch with motion the role "
            "of a test."
        )
    is_resting = find_resting_channels(measure.records, measure.noise)
    if not is_resting.any():
        return ""
    resting_names = conjoin([name for name, rests in zip(channels, is_resting, strict=True) if rests])
    return (
        f"The held-out data contain no motion of {resting_names}, so the error on them is that of the other channels. "
        "Give a stretch in which all move the role of a test."
    )


def _collect_remarks(
    first_remarks: Sequence[Sequence[str]], tuning: Tuning, floors: tuple[NoiseFloor, ...]
) -> tuple[str, ...]:
    """Collect remarks without repetition: first_remarks, then on unknown units, and on the noise. A remark that does
    not hold for all floors (one per recording or part) begins with their number, for others may say the contrary."""
    floor_counts = Counter(remark for floor in floors for remark in dict.fromkeys(floor.remarks))
    noise_remarks = (
        remark if floor_count == len(floors) else f"In {floor_count} of {len(floors)} recordings or parts: {remark}"
        for remark, floor_count in floor_counts.items()
    )
    remarks = (
        *(remark for group in first_remarks for remark in group),
        describe_unknown_units(tuning.model),
        *noise_remarks,
    )
    return tuple(dict.fromkeys(filter(None, remarks)))


def _measure_split_s(measure: ErrorMeasure) -> dict[str, float]:
    """Measure the duration (s) of the samples to fit, to choose and to test by; keys "fit", "choose", "test"."""
    rate_hz = measure.records[0].recording.sample_rate_hz
    return {
        part: sum(int(getattr(record, part).sum()) for record in measure.records) / rate_hz
        for part in ("fit", "choose", "test")
    }


def _compute_standard_errors(result: SearchResult) -> FloatArray:
    """Compute the standard errors of the model's own parameters, then of the named effects' parameters; NaN where they
    are not computed. See `compute_final_errors`."""
    context, explanation = result.context, result.found
    own_count, effect_count = len(context.tuning.names), len(explanation.after.fitted.hypothesis.point)
    if explanation.statistic is not None:
        return np.concatenate([np.full(own_count, np.nan), explanation.statistic.errors])
    if result.errors is not None and result.judgement.named:
        return result.errors
    if result.judgement.named or context.tuning.model.coordinates == 1:
        return compute_final_errors(context, explanation if result.judgement.named else replace(explanation, steps=()))
    return np.full(own_count + effect_count, np.nan)


def _build_document(
    result: SearchResult, errors: FloatArray, examined: tuple[MismatchMaps, Localisation], proposal: "Proposal | None"
) -> Diagnosis:
    """Build the document. errors: standard errors of all parameters. examined: mismatch maps and localisation."""
    explanation, judgement = result.found, result.judgement
    measure, tuning, fitted = result.context.full_measure, result.context.tuning, explanation.after.fitted
    maps, localisation = examined
    labels = make_labels(measure.records[0].recording, tuning.model)
    return Diagnosis(
        verdict=judgement.verdict,
        mismatch=list_mismatch_rows(maps.cells["before"], localisation.states["before"])
        or (
            ()
            if judgement.verdict == "no_mismatch"
            else summarise_worst_channel(measure, explanation.before.score, explanation.before.fitted)
        ),
        effects=_list_effects_with_gains(result, errors, labels) if judgement.named else (),
        retuned=dict(zip(tuning.names, tuning.to_changes(fitted.deviations).tolist(), strict=True)),
        remainder=()
        if judgement.verdict not in ("partly_explained", "unexplained")
        else list_impact_remainder(measure, explanation)
        or list_mismatch_rows(maps.cells["after"], localisation.states["after"])
        or summarise_worst_channel(measure, explanation.after.score, fitted),
        fit=compute_fit_errors(measure, explanation),
        error=measure.name,
        next_experiment=None if proposal is None else proposal.document,
    )


def _compute_interval_errors(result: SearchResult, errors: FloatArray) -> FloatArray:
    """Compute (parameters,): standard errors of the named effects' parameters for the intervals that are stated."""
    own_count = len(result.context.tuning.names)
    if result.found.statistic is not None:
        return INTERVAL_FACTOR * errors[own_count:]
    return compute_interval_errors(result.context, result.found, errors)[own_count:]


def _list_effects_with_gains(result: SearchResult, errors: FloatArray, labels: Labels) -> tuple[NamedEffect, ...]:
    """List the named effects, with their gains on held-out data where samples were compared and every step of the
    search has its effect."""
    context, explanation = result.context, result.found
    effects = make_named_effects(explanation, _compute_interval_errors(result, errors), labels)
    if explanation.statistic is not None or len(explanation.steps) != len(effects):
        return effects
    intermediate_fits = [context.with_test_score(step) for step in explanation.steps[:-1]]
    return add_held_out_gains(effects, context.full_measure, (explanation.plain, *intermediate_fits, explanation.after))


def _propose(context: SearchContext, explanation: Explanation, judgement: Judgement) -> "Proposal | None":
    """Propose the next recordings; None where no effect is named, no free simulation or only band powers were compared,
    or there is nothing to propose."""
    if not judgement.named or context.full_measure.name != "free simulation" or explanation.statistic is not None:
        return None
    # Imported here: only named effects have rivals that a further recording could separate.
    from analysis.diagnosis.next_experiment.propose_experiment import propose_experiment

    return propose_experiment(context, explanation)


def list_channel_names(recording: Recording, channel_count: int) -> tuple[str, ...]:
    """List the names of the response's channels, then of the position's, at most channel_count."""
    position = () if recording.position is None else recording.position.channels
    return (*recording.response.channels, *position)[:channel_count]


def list_reading_units(recording: Recording) -> dict[str | None, str]:
    """List the units of the response channels: `Findings.reading_units`."""
    channels, units = recording.response.channels, recording.response.units
    names = (shorten_axis_name(channel, channels) for channel in channels)
    reading_units: dict[str | None, str] = dict(zip(names, units, strict=True))
    return reading_units | ({None: units[0]} if len(set(units)) == 1 else {})


def _build_time_series(measure: ErrorMeasure, explanation: Explanation, names: Sequence[str]) -> tuple[TimeSeries, ...]:
    """Build, per record, the measured signals and those predicted at each stage. names: of the records; those beyond
    them are numbered."""
    time_series = []
    for record_index, record in enumerate(measure.records):
        channel_count = record.measured.shape[1]
        given_predicted, retuned_predicted, completed_predicted = (
            record.measured - candidate.fitted.residuals[record_index] * measure.unit
            for candidate in (explanation.before, explanation.retuned, explanation.after)
        )
        time_series.append(
            TimeSeries(
                name=names[record_index] if record_index < len(names) else f"recording {record_index + 1}",
                sample_rate_hz=record.recording.sample_rate_hz,
                channels=list_channel_names(record.recording, channel_count),
                units=_list_units(record.recording)[:channel_count],
                measured=record.measured,
                before=given_predicted,
                retuned=retuned_predicted,
                after=completed_predicted,
                tested=tuple(find_runs(record.test)),
            )
        )
    return tuple(time_series)


def _list_units(recording: Recording) -> tuple[str, ...]:
    """List the unit of each channel of the response, then of the position."""
    signals = [signal for signal in (recording.response, recording.position) if signal is not None]
    return tuple(
        signal.unit if isinstance(signal.unit, str) else signal.unit[channel]
        for signal in signals
        for channel in range(len(signal.channels))
    )


def list_impact_remainder(measure: ErrorMeasure, explanation: Explanation) -> tuple[Mismatch, ...]:
    """List a row for each channel whose band powers differ by more than chance (`EXPLAINED_BY_CHANCE`), the largest
    error first; the share is the rms logarithm of the ratio of amplitudes, at most 1. For impacts, which are compared
    by band power because no simulation predicts single ones; empty where samples were compared."""
    if explanation.statistic is None:
        return ()
    record, score = measure.records[0].recording, explanation.after.score
    channel_names = (*record.response.channels, *(() if record.position is None else record.position.channels))
    channel_errors = np.maximum(score.fit, score.choose)
    return tuple(
        Mismatch(
            channel_names[channel], "+".join(record.command.channels), (0.0, record.sample_rate_hz / 2), None, None,
            min(float(channel_errors[channel] * explanation.statistic.chance[channel]), 1.0), 0.0,
        )
        for channel in np.argsort(-channel_errors).tolist()
        if channel_errors[channel] > EXPLAINED_BY_CHANCE
    )  # fmt: skip
