"""Diagnose one recording of a real device (`hapteq real`). Begin at `diagnose_real`.

1. The recording is imported by its map. Its model is the map's, or a linear model or force balance fitted to it.
2. `diagnose` searches for missing effects. Where a recording from before a known change exists, it is the reference.
3. The resulting model is tested on further recordings, to which at most a gain is fitted (`volume_free` in the map).

A recording that cannot be diagnosed gets the verdict "refused", with the reason as its answer.
"""

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from analysis.diagnosis.data.input_checks import NothingToDiagnoseError, require_model_of
from analysis.diagnosis.data.measured_motion import convert_all_to_force_driven
from analysis.diagnosis.diagnose import diagnose
from analysis.diagnosis.diagnosis_settings import DiagnosisSettings
from analysis.diagnosis.errors.prediction_error import PredictionError, compute_prediction_error
from analysis.diagnosis.first_model.first_model import FirstModel
from analysis.diagnosis.first_model.one_motion_per_force import convert_to_driven_motions
from analysis.diagnosis.limits import EXPLAINED_ERROR
from analysis.diagnosis.localisation.model_error_floor import IncomparableRecordingsError
from analysis.diagnosis.prepare_recordings import keep_common_signals, prepare_recordings
from analysis.diagnosis.real_answer.make_real_answer import describe_named_effects, make_real_answer
from analysis.diagnosis.real_answer.real_answer import FurtherTest, HeldOutStretch, PairOutcome, RealAnswer
from analysis.diagnosis.result.findings import Findings
from analysis.diagnosis.search.guard import Guard
from analysis.diagnosis.types import Progress, TimeBudget
from equalizer.plant.mechanical_model import MechanicalModelError
from equalizer.signals.isolated_samples import interpolate_isolated_samples
from equalizer.signals.recording import Recording
from study.errors import StudyError
from study.evaluation.real.real_folder import RealRecording
from study.importing.build_recording import build_recording
from study.importing.map_library import FoundMap
from study.workflows.diagnosis.diagnosis_input import DiagnosisInput, make_not_diagnosable_error
from study.workflows.diagnosis.fit_without_model import fit_first_model, fit_linear_model
from study.workflows.forked_map import map_forked


@dataclass(frozen=True, slots=True, eq=False)
class RealDiagnosis:
    """Answer of the diagnosis for a real recording, with its findings and input files."""

    answer: RealAnswer
    findings: Findings | None
    """None where the recording was refused."""
    parents: tuple[Path, ...]
    """`RealRecording.parents`."""


@dataclass(frozen=True, slots=True, eq=False)
class _ImportedCase:
    """The imported recording with its model and reference recording."""

    recording: Recording
    first_model: FirstModel
    """Model to be diagnosed, given or fitted to the recording."""
    remarks: tuple[str, ...]
    """Sentences on the import."""
    reference: Recording | None
    """Recording of the same device before the change, where there is one."""


def make_crash_result(real_recording: RealRecording, crash: Exception) -> RealDiagnosis:
    """Make the result for a recording at which the program crashed: refused, with the exception as the reason."""
    error_text = f"{type(crash).__name__}: {crash}".rstrip(": .")
    crash_text = (
        f"The program crashed at this recording ({error_text}). "
        "That is a fault of the program; the others are answered."
    )
    return RealDiagnosis(_make_refusal(real_recording, crash_text), None, real_recording.parents)


def diagnose_real(
    real_recording: RealRecording, time_left: TimeBudget, guard: Guard, on_progress: Progress
) -> RealDiagnosis:
    """Diagnose one recording. One that cannot be diagnosed, by any StudyError or because the fits break down, is
    returned as refused, with the reason. Any other exception but KeyboardInterrupt is a fault of the program, see
    `make_crash_result`."""
    parents = real_recording.parents
    try:
        case = _import_case(real_recording, (time_left, guard), on_progress)
        settings = DiagnosisSettings(
            names=(real_recording.name,),
            clean=() if case.reference is None else (case.reference,),
            fitted=real_recording.read_model() is None,
            balances=case.first_model.balances,
            time_left=time_left,
            guard=guard,
        )
        findings = diagnose((case.recording,), case.first_model.model, settings, map_forked, on_progress)
        first_remarks = case.first_model.list_remarks(findings.given, findings.diagnosis.error)
        findings = replace(findings, remarks=(*case.remarks, *first_remarks, *findings.remarks))
        diagnosis = real_recording.found_map.source.map.diagnosis
        recording_names = (real_recording.folder.name, real_recording.name, real_recording.found_map.source.map.title)
        answer = make_real_answer(findings, case.recording, recording_names, diagnosis.nominal)
    except StudyError as refusal:
        return RealDiagnosis(_make_refusal(real_recording, f"{refusal.title}: {refusal.happened}"), None, parents)
    except (IncomparableRecordingsError, MechanicalModelError, np.linalg.LinAlgError) as refusal:
        return RealDiagnosis(_make_refusal(real_recording, f"The fits broke down: {refusal}."), None, parents)
    further_tests = tuple(_test_on_recording(test, real_recording, findings) for test in real_recording.tests)
    pair = None if case.reference is None else _compare_pair(real_recording, case, findings)
    objections = (
        *diagnosis.objections,
        *(objection for test in real_recording.tests for objection in test.source.map.diagnosis.objections),
    )
    answer = replace(answer, further=further_tests, pair=pair, objections=objections)
    return RealDiagnosis(answer if pair is None else _downgrade_if_remainder(answer, pair), findings, parents)


def _downgrade_if_remainder(answer: RealAnswer, pair: PairOutcome) -> RealAnswer:
    """Downgrade "explained" to "partly explained" where the error that remains with the effects exceeds
    `EXPLAINED_ERROR` times that of the model before the change: a single reference recording leaves wide uncertainty
    for the verdict."""
    remaining_error, reference_error = pair.with_effects, pair.expected_left
    if (
        answer.verdict != "explained"
        or remaining_error is None
        or reference_error is None
        or remaining_error <= EXPLAINED_ERROR * reference_error
    ):
        return answer
    remainder_text = (
        f"Still unexplained: the error on held-out data is {100 * remaining_error:.3g} % of the signal; "
        f"before the change it was {100 * reference_error:.3g} %."
    )
    return replace(
        answer, verdict="partly_explained", left=remainder_text, pair=replace(pair, verdict="partly_explained")
    )


def import_real_recording(found_map: FoundMap) -> Recording:
    """Import the recording of a map, converted to a force-driven one. Raises StudyError where it cannot be imported."""
    recording = build_recording(found_map.source.map, found_map.files, lambda share: None).recording
    return convert_all_to_force_driven([recording])[0]


def _import_case(
    real_recording: RealRecording, bounds: tuple[TimeBudget, Guard], on_progress: Progress
) -> _ImportedCase:
    """Import the recording, its model and the reference recording. Raises StudyError where there is nothing to
    diagnose."""
    on_progress("importing", 0.0)
    if skip_reason := real_recording.found_map.source.map.diagnosis.skip:
        raise make_not_diagnosable_error((skip_reason,))
    # A recording with few cycles is accepted with a remark, because a real one cannot be replaced by a longer one.
    try:
        prepared = prepare_recordings(
            (import_real_recording(real_recording.found_map),),
            (real_recording.name,),
            _allows_force_balance(real_recording),
            accept_short=True,
        )
    except NothingToDiagnoseError as refusal:
        raise make_not_diagnosable_error(refusal.problems) from refusal
    references, reference_remarks = _import_reference(real_recording.reference)
    kept_signals = keep_common_signals((*prepared.recordings, *references))
    recording = kept_signals.recordings[0]
    first_model = _choose_model(real_recording, recording, bounds, on_progress)
    remarks = (*prepared.remarks, *reference_remarks, *kept_signals.remarks)
    return _ImportedCase(recording, first_model, remarks, kept_signals.recordings[1] if references else None)


def _import_reference(found_map: FoundMap | None) -> tuple[tuple[Recording, ...], tuple[str, ...]]:
    """Import the reference recording without isolated samples, as `prepare_recordings` does with the other: spikes in
    one of both alone would look like a change of the device. Returns it and a remark on what was changed; both empty
    for None."""
    if found_map is None:
        return (), ()
    recording, change_text = interpolate_isolated_samples(import_real_recording(found_map))
    return (recording,), ((f"{found_map.name}: {change_text}",) if change_text else ())


def _allows_force_balance(real_recording: RealRecording) -> bool:
    """Whether a force balance of the recording is possible: neither a given model nor a reference recording fixes its
    commands and responses."""
    return real_recording.reference is None and real_recording.read_model() is None


def _choose_model(
    real_recording: RealRecording, recording: Recording, bounds: tuple[TimeBudget, Guard], on_progress: Progress
) -> FirstModel:
    """Choose the given model, else a linear model fitted to the recording, with a force balance where there is no
    reference recording. The fit reports a tenth of the progress. Raises StudyError where the given model does not fit
    the channels, or none can be fitted."""
    given_model = real_recording.read_model()
    if given_model is None:
        diagnosis_input = DiagnosisInput((recording,), (real_recording.name,), real_recording.found_map.files, ())
        if real_recording.reference is not None:
            return FirstModel(
                *fit_linear_model(diagnosis_input, lambda share: on_progress("fitting a linear model", 0.1 * share))
            )
        return fit_first_model(diagnosis_input, (), bounds, lambda step, share: on_progress(step, 0.1 * share))
    try:
        require_model_of(given_model, (recording,))
    except NothingToDiagnoseError as refusal:
        raise make_not_diagnosable_error(refusal.problems) from refusal
    return FirstModel(given_model, ())


def _make_refusal(real_recording: RealRecording, reason_text: str) -> RealAnswer:
    """Make the answer for a recording that is not diagnosed. reason_text: why, as a sentence."""
    diagnosis = real_recording.found_map.source.map.diagnosis
    return RealAnswer(
        folder=real_recording.folder.name,
        recording=real_recording.name,
        title=real_recording.found_map.source.map.title,
        device=real_recording.found_map.source.map.device,
        verdict="refused",
        answer=reason_text,
        model="",
        error="",
        fitted=None,
        held_out=None,
        black_box=None,
        where=(),
        named=(),
        effects=(),
        left="",
        remarks=(),
        numbers=(),
        stretches=(),
        excerpt=None,
        further=(),
        pair=None,
        objections=diagnosis.objections,
        seconds=0.0,
    )


def _test_on_recording(test_map: FoundMap, real_recording: RealRecording, findings: Findings) -> FurtherTest:
    """Test the re-tuned and the improved model on a further recording; at most its gain is fitted to it (`volume_free`
    in the map). The sign of the commands is not chosen again for this recording (may_reverse=False): it was decided
    once, for all recordings of the device. A recording that cannot be used gives a test with the problem as text."""
    title, has_free_gain = test_map.source.map.title, test_map.source.map.diagnosis.volume_free
    retuned_model = findings.retuned
    assert retuned_model is not None  # the findings of an answered recording always have it
    try:
        recording = import_real_recording(test_map)
        if _allows_force_balance(real_recording):
            (recording,) = convert_all_to_force_driven(convert_to_driven_motions((recording,), may_reverse=False)[0])
        retuned_error, improved_error = (
            compute_prediction_error(recording, model, "all") for model in (retuned_model, findings.improved)
        )
    except (StudyError, MechanicalModelError, ValueError, np.linalg.LinAlgError) as problem:
        problem_text = problem.happened if isinstance(problem, StudyError) else f"{problem}."
        return FurtherTest(test_map.name, title, "", None, None, problem=problem_text)
    error_without, error_with = (
        errors.with_gain if has_free_gain else errors.without_gain for errors in (retuned_error, improved_error)
    )
    error_label = improved_error.measure_name + (", one factor fitted" if has_free_gain else "")
    stretches = (
        ()
        if has_free_gain or improved_error.measure_name == "predicted force"
        else _make_full_record_stretches(test_map.name, recording, retuned_error, improved_error)
    )
    return FurtherTest(test_map.name, title, error_label, error_without, error_with, stretches)


def _make_full_record_stretches(
    name: str, recording: Recording, retuned_error: PredictionError, improved_error: PredictionError
) -> tuple[HeldOutStretch, ...]:
    """Make one held-out stretch per channel from the whole recording, with the errors of both models."""
    duration_s = len(recording) / recording.sample_rate_hz
    return tuple(
        HeldOutStretch(
            name, channel.name, channel.unit, 0.0, duration_s, channel.signal, channel.error, improved_channel.error
        )
        for channel, improved_channel in zip(retuned_error.channels, improved_error.channels, strict=False)
    )


def _compare_pair(real_recording: RealRecording, case: _ImportedCase, findings: Findings) -> PairOutcome:
    """Compare the recordings before and after a change of the device: the named effects, and the errors of the model
    before and after it was re-tuned and effects were added. Both recordings must exist."""
    assert real_recording.reference is not None and case.reference is not None
    given_errors = compute_prediction_error(case.recording, case.first_model.model, "test")
    reference_errors = compute_prediction_error(case.reference, case.first_model.model, "test")
    test_errors = findings.diagnosis.fit.test
    return PairOutcome(
        changed=real_recording.changed,
        before=", ".join(path.name for path in real_recording.reference.files),
        after=", ".join(path.name for path in real_recording.found_map.files),
        verdict=findings.diagnosis.verdict,
        named=describe_named_effects(findings),
        returned=findings.diagnosis.returned_set,
        as_before=given_errors.without_gain,
        gain=given_errors.with_gain,
        retuned=test_errors.retuned,
        with_effects=test_errors.after if findings.diagnosis.effects else None,
        expected_left=reference_errors.without_gain,
    )
