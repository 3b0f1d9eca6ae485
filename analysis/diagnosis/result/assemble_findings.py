"""Assembles the findings of a finished search: the document (`Diagnosis`), and the data of figures and sentences.

In this order: labels and re-tuned models, standard errors, mismatch maps of the given, re-tuned and completed model,
examination of the fits (`post_search`), choice of the next recording, document.
"""

from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from analysis.diagnosis.data.measured_motion import is_quasi_static
from analysis.diagnosis.data.recorded_conditions import as_recorded
from analysis.diagnosis.document import Diagnosis, Mismatch, NamedEffect
from analysis.diagnosis.errors.error_measure import ErrorMeasure
from analysis.diagnosis.errors.error_measure_rule import IN_SAMPLES
from analysis.diagnosis.errors.tuning import Tuning
from analysis.diagnosis.localisation.clean_floor import CleanFloor, clean_floor_sentence
from analysis.diagnosis.localisation.localisation import Localisation
from analysis.diagnosis.localisation.mismatch_maps import Maps, mismatch_maps, whole_mismatch
from analysis.diagnosis.localisation.mismatch_rows import mismatch_rows
from analysis.diagnosis.noise.noise_floor import NoiseFloor
from analysis.diagnosis.result.error_table import channel_errors, errors_of, held_out_stands_still
from analysis.diagnosis.result.findings import Findings, TimeSeries
from analysis.diagnosis.result.named_effects import Labels, labels_of, named_effects
from analysis.diagnosis.result.post_search import examine_fits
from analysis.diagnosis.result.unconfirmed import with_gains
from analysis.diagnosis.result.unit_doubt import constant_sentence, unit_sentences
from analysis.diagnosis.search.explain import Explanation
from analysis.diagnosis.search.identifiability import final_errors, interval_errors
from analysis.diagnosis.search.search_context import SearchContext
from analysis.diagnosis.search.verdict import Judgement, SearchResult
from analysis.diagnosis.settings import EXPLAINED_BY_CHANCE, INTERVAL_FACTOR
from equalizer.effects.placing import axis_letter, model_effects
from equalizer.plant.mechanical_model import MechanicalModel
from equalizer.signals.recording import Recording
from equalizer.signals.signal import FloatArray, runs_of

if TYPE_CHECKING:
    from analysis.diagnosis.next_experiment.propose_experiment import Proposal


def assemble_findings(
    result: SearchResult, floors: tuple[NoiseFloor, ...], names: Sequence[str], learned: CleanFloor
) -> Findings:
    """The findings of a search. result.found.after: the model with the named effects, or the re-tuned model without
    any. names: of the recordings. learned: the residual of clean recordings, counted as noise."""
    context, found, judged = result.context, result.found, result.judgement
    measure, tuning = context.whole, context.tuning
    recording, placed = measure.records[0].recording, found.after.fitted.hypothesis.list_placed_effects()
    labels, (improved, retuned) = labels_of(recording, tuning.model), _models(result, recording)
    channels, errors = channel_names(recording, len(measure.noise)), _standard_errors(result)
    maps = mismatch_maps(measure, found.stages, floors, learned, context.map_)
    time_series = _time_series(measure, found, names)
    examined = examine_fits(result, floors[0], maps)
    in_samples = "" if recording.is_timed or is_quasi_static(recording) else IN_SAMPLES
    proposal = context.guard.part("the next recording", "its choice", partial(_proposal, context, found, judged), None)
    return Findings(
        diagnosis=_document(result, errors, (maps, examined.local), proposal),
        explanation=found,
        given=tuning.model,
        improved=improved,
        retuned=retuned,
        named=placed,
        evidence=examined.evidence,
        time_series=time_series,
        noise_rms=dict(zip(channels, measure.noise.tolist(), strict=True)),
        channel_errors=channel_errors(found, channels),
        mismatch=maps.rows,
        is_timed=recording.is_timed,
        signatures=examined.signatures,
        black_box=examined.black_box,
        remarks=_remarks(
            (_still_sentence(measure), clean_floor_sentence(learned, channels), in_samples), time_series, tuning, floors
        ),
        maps=maps.cells,
        local=examined.local,
        floor=floors[0],
        tuning=tuning,
        axes=tuple(axis_letter(name, labels.inputs) for name in labels.inputs),
        proposal=proposal,
        split_s=_split_s(measure),
        own_errors=errors[: len(tuning.names)] * tuning.deviation,
    )


def _models(result: SearchResult, recording: Recording) -> tuple[MechanicalModel, MechanicalModel]:
    """The re-tuned models with the named effects and without, driven by the commands as they were recorded."""
    tuning, found = result.context.tuning, result.found
    fitted, labels = found.after.fitted, labels_of(recording, tuning.model)
    effects = (
        *tuning.model.effects,
        *model_effects(fitted.hypothesis.list_placed_effects(), labels.inputs, labels.outputs),
    )
    with_them = replace(tuning.tune(fitted.deviations), effects=effects)
    return as_recorded(with_them, recording), as_recorded(tuning.tune(found.retuned.fitted.deviations), recording)


def _still_sentence(measure: ErrorMeasure) -> str:
    """Sentence where the held-out samples contain no motion; else empty."""
    if not held_out_stands_still(measure.records, measure.noise):
        return ""
    return (
        "The held-out data contain no motion, so no error on them is stated. Give a stretch with motion the role of "
        "a test."
    )


def _remarks(
    first: Sequence[str], time_series: Sequence[TimeSeries], tuning: Tuning, floors: tuple[NoiseFloor, ...]
) -> tuple[str, ...]:
    """Remarks without repetition: the first, doubtful units, a constant force of the model, and those of the noise."""
    of_noise = (remark for floor in floors for remark in floor.remarks)
    texts = (*first, *unit_sentences(time_series), constant_sentence(tuning.model), *of_noise)
    return tuple(dict.fromkeys(filter(None, texts)))


def _split_s(measure: ErrorMeasure) -> dict[str, float]:
    """Seconds to fit, to choose and to test by."""
    rate_hz = measure.records[0].recording.sample_rate_hz
    return {
        part: sum(int(getattr(record, part).sum()) for record in measure.records) / rate_hz
        for part in ("fit", "choose", "test")
    }


def _standard_errors(result: SearchResult) -> FloatArray:
    """Standard errors of the model's own parameters, then of the named effects' parameters; NaN where they are not
    computed. See `final_errors`."""
    context, found = result.context, result.found
    own, numbers = len(context.tuning.names), len(found.after.fitted.hypothesis.point)
    if found.statistic is not None:
        return np.concatenate([np.full(own, np.nan), found.statistic.errors])
    if result.errors is not None and result.judgement.named:
        return result.errors
    if result.judgement.named or context.tuning.model.coordinates == 1:
        return final_errors(context, found if result.judgement.named else replace(found, steps=()))
    return np.full(own + numbers, np.nan)


def _document(
    result: SearchResult, errors: FloatArray, examined: tuple[Maps, Localisation], proposal: "Proposal | None"
) -> Diagnosis:
    """The document. errors: standard errors of all parameters. examined: mismatch maps and localisation."""
    found, judged = result.found, result.judgement
    measure, tuning, fitted = result.context.whole, result.context.tuning, found.after.fitted
    maps, local = examined
    labels = labels_of(measure.records[0].recording, tuning.model)
    return Diagnosis(
        verdict=judged.verdict,
        mismatch=mismatch_rows(maps.cells["before"], local.states["before"])
        or (
            () if judged.verdict == "no_mismatch" else whole_mismatch(measure, found.before.score, found.before.fitted)
        ),
        effects=_effects_with_gains(result, errors, labels) if judged.named else (),
        retuned=dict(zip(tuning.names, tuning.values(fitted.deviations).tolist(), strict=True)),
        remainder=()
        if judged.verdict not in ("partly_explained", "unexplained")
        else impact_remainder(measure, found)
        or mismatch_rows(maps.cells["after"], local.states["after"])
        or whole_mismatch(measure, found.after.score, fitted),
        fit=errors_of(measure, found),
        error=measure.name,
        next_experiment=None if proposal is None else proposal.document,
    )


def _interval_errors(result: SearchResult, errors: FloatArray) -> FloatArray:
    """(parameters,): standard errors of the named effects' parameters for the intervals that are stated."""
    own = len(result.context.tuning.names)
    if result.found.statistic is not None:
        return INTERVAL_FACTOR * errors[own:]
    return interval_errors(result.context, result.found, errors)[own:]


def _effects_with_gains(result: SearchResult, errors: FloatArray, labels: Labels) -> tuple[NamedEffect, ...]:
    """The named effects, with their gains on held-out data where samples were compared."""
    context, found = result.context, result.found
    effects = named_effects(found, _interval_errors(result, errors), labels)
    if found.statistic is not None or len(found.steps) != len(effects):
        return effects
    between = [context.with_test_score(step) for step in found.steps[:-1]]
    return with_gains(effects, context.whole, (found.plain, *between, found.after))


def _proposal(context: SearchContext, found: Explanation, judged: Judgement) -> "Proposal | None":
    """Proposal of the next recording; None where no effect is named, or where recordings cannot be predicted by
    simulation."""
    if not judged.named or context.whole.name != "free simulation" or found.statistic is not None:
        return None
    # Imported here: only named effects have rivals that a further recording could separate.
    from analysis.diagnosis.next_experiment.propose_experiment import propose_experiment

    return propose_experiment(context, found)


def channel_names(recording: Recording, count: int) -> tuple[str, ...]:
    """Names of the response's channels, then of the position's, as many as `count`."""
    position = () if recording.position is None else recording.position.channels
    return (*recording.response.channels, *position)[:count]


def _time_series(measure: ErrorMeasure, found: Explanation, names: Sequence[str]) -> tuple[TimeSeries, ...]:
    """Measured signals and those predicted at each stage, per recording."""
    time_series = []
    for number, record in enumerate(measure.records):
        count = record.measured.shape[1]
        before, retuned, after = (
            record.measured - candidate.fitted.residuals[number] * measure.unit
            for candidate in (found.before, found.retuned, found.after)
        )
        time_series.append(
            TimeSeries(
                name=names[number] if number < len(names) else f"recording {number + 1}",
                sample_rate_hz=record.recording.sample_rate_hz,
                channels=channel_names(record.recording, count),
                units=_units(record.recording)[:count],
                measured=record.measured,
                before=before,
                retuned=retuned,
                after=after,
                tested=tuple(runs_of(record.test)),
            )
        )
    return tuple(time_series)


def _units(recording: Recording) -> tuple[str, ...]:
    """Unit of each channel of the response, then of the position."""
    signals = [signal for signal in (recording.response, recording.position) if signal is not None]
    return tuple(
        signal.unit if isinstance(signal.unit, str) else signal.unit[k]
        for signal in signals
        for k in range(len(signal.channels))
    )


def impact_remainder(measure: ErrorMeasure, found: Explanation) -> tuple[Mismatch, ...]:
    """One row for each channel whose band powers differ by more than chance; the share is the rms logarithm of the
    ratio of amplitudes. For impacts, which are compared by band power because no simulation predicts single ones; empty
    where samples were compared."""
    if found.statistic is None:
        return ()
    record, score = measure.records[0].recording, found.after.score
    names = (*record.response.channels, *(() if record.position is None else record.position.channels))
    worst = np.maximum(score.fit, score.choose)
    return tuple(
        Mismatch(
            names[c], "+".join(record.command.channels), (0.0, record.sample_rate_hz / 2), None, None,
            min(float(worst[c] * found.statistic.chance[c]), 1.0), 0.0,
        )
        for c in np.argsort(-worst).tolist()
        if worst[c] > EXPLAINED_BY_CHANCE
    )  # fmt: skip
