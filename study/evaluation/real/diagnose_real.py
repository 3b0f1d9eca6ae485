"""Diagnosis of one recording of a real device.

1. The recording is imported by its map. Its model is the map's, or a linear model or force balance fitted to it.
2. `diagnose` searches for missing effects. Where a recording from before a known change exists, it is the reference.
3. The resulting model is tested on further recordings, to which nothing is fitted but, where the map says so, a gain.

A recording that cannot be diagnosed gets an answer all the same: refused, with the reason.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from analysis.diagnosis.balance.judge_laws import Balance
from analysis.diagnosis.data.input_checks import NothingToDiagnose, require_model_of
from analysis.diagnosis.data.measured_motion import all_as_force_driven
from analysis.diagnosis.diagnose import diagnose
from analysis.diagnosis.diagnosis_settings import DiagnosisSettings
from analysis.diagnosis.errors.prediction_error import PredictionError, prediction_error
from analysis.diagnosis.first_model.first_model import FirstModel
from analysis.diagnosis.first_model.one_motion_per_force import one_motion_per_force
from analysis.diagnosis.localisation.clean_floor import NothingLearned
from analysis.diagnosis.prepare_recordings import keep_common_signals, prepare
from analysis.diagnosis.real_answer.answer_of_findings import answer_of_findings, describe_named
from analysis.diagnosis.real_answer.real_answer import FurtherTest, HeldOutStretch, PairOutcome, RealAnswer
from analysis.diagnosis.result.findings import Findings
from analysis.diagnosis.search.guard import Guard
from analysis.diagnosis.settings import EXPLAINED_ERROR
from analysis.diagnosis.types import Progress, TimeBudget
from equalizer.plant.mechanical_model import MechanicalModel, MechanicalModelError
from equalizer.signals.recording import Recording
from study.errors import StudyError
from study.evaluation.real.real_folder import RealRecording
from study.importing.build_recording import build_recording
from study.importing.map_library import FoundMap
from study.workflows.diagnosis.diagnosis_input import DiagnosisInput, not_diagnosable_error
from study.workflows.diagnosis.fit_without_model import first_model_of, fit_linear_model
from study.workflows.forked_map import map_forked


@dataclass(frozen=True, slots=True, eq=False)
class RealDiagnosis:
    """Answer of the diagnosis for a real recording, with its findings and input files."""

    answer: RealAnswer
    findings: Findings | None
    """None where the recording was refused."""
    parents: tuple[Path, ...]


@dataclass(frozen=True, slots=True, eq=False)
class _ImportedCase:
    """The imported recording and what its diagnosis needs."""

    recording: Recording
    model: MechanicalModel
    balances: tuple[Balance, ...] | None
    remarks: tuple[str, ...]
    before: Recording | None
    """Recording of the same device before the change, where there is one."""


def report_crash(wanted: RealRecording, crash: Exception) -> RealDiagnosis:
    """Result for a recording at which the program crashed."""
    error = f"{type(crash).__name__}: {crash}".rstrip(": .")
    broken = (
        f"The program crashed at this recording ({error}). That is a fault of the program; the others are answered."
    )
    return RealDiagnosis(_refusal(wanted, broken), None, wanted.parents)


def diagnose_real(wanted: RealRecording, time_left: TimeBudget, guard: Guard, on_progress: Progress) -> RealDiagnosis:
    """Diagnose one recording. One that cannot be diagnosed is returned as refused, with the reason. Raises only
    UserInterruptError."""
    parents = wanted.parents
    try:
        case = _import_case(wanted, (time_left, guard), on_progress)
        settings = DiagnosisSettings(
            names=(wanted.name,),
            clean=() if case.before is None else (case.before,),
            fitted=wanted.model() is None,
            balances=case.balances,
            time_left=time_left,
            guard=guard,
        )
        found = diagnose((case.recording,), case.model, settings, map_forked, on_progress)
        found = replace(found, remarks=(*case.remarks, *found.remarks))
        diagnosis = wanted.found.source.map.diagnosis
        names = (wanted.folder.name, wanted.name, wanted.found.source.map.title)
        answer = answer_of_findings(found, case.recording, names, diagnosis.nominal)
    except StudyError as refusal:
        return RealDiagnosis(_refusal(wanted, f"{refusal.title}: {refusal.happened}"), None, parents)
    except (NothingLearned, MechanicalModelError, np.linalg.LinAlgError) as refusal:
        return RealDiagnosis(_refusal(wanted, f"The fits broke down: {refusal}."), None, parents)
    further = tuple(_test_on_further(each, wanted, found) for each in wanted.tests)
    pair = None if case.before is None else _compare_pair(wanted, case, found)
    objections = (
        *diagnosis.objections,
        *(objection for each in wanted.tests for objection in each.source.map.diagnosis.objections),
    )
    answer = replace(answer, further=further, pair=pair, objections=objections)
    return RealDiagnosis(answer if pair is None else _downgrade_if_remainder(answer, pair), found, parents)


def _downgrade_if_remainder(answer: RealAnswer, pair: PairOutcome) -> RealAnswer:
    """Downgrade "explained" to "partly explained" where the recording made before the change shows a remainder
    beyond what the model missed then: a single reference recording leaves wide uncertainty."""
    left, missed = pair.with_effects, pair.expected_left
    if answer.verdict != "explained" or left is None or missed is None or left <= EXPLAINED_ERROR * missed:
        return answer
    text = (
        f"Still unexplained: the error on held-out data is {100 * left:.3g} % of the signal; before the change it was "
        f"{100 * missed:.3g} %."
    )
    return replace(answer, verdict="partly_explained", left=text, pair=replace(pair, verdict="partly_explained"))


def import_real_recording(found: FoundMap) -> Recording:
    """The one force-driven recording of a map. Raises StudyError."""
    recording = build_recording(found.source.map, found.files, lambda share: None).recording
    return all_as_force_driven([recording])[0]


def _import_case(wanted: RealRecording, bounds: tuple[TimeBudget, Guard], on_progress: Progress) -> _ImportedCase:
    """Import the recording, its model and the recording made before. Raises StudyError where there is nothing to
    diagnose."""
    on_progress("importing", 0.0)
    if why := wanted.found.source.map.diagnosis.skip:
        raise not_diagnosable_error((why,))
    # Of a real recording, for which there is no other, few cycles are a remark.
    try:
        ready = prepare((import_real_recording(wanted.found),), (wanted.name,), _is_plain(wanted), short=True)
    except NothingToDiagnose as refusal:
        raise not_diagnosable_error(refusal.problems) from refusal
    before = () if wanted.before is None else (import_real_recording(wanted.before),)
    alike = keep_common_signals((*ready.recordings, *before))
    recording = alike.recordings[0]
    first = _model(wanted, recording, bounds, on_progress)
    remarks = (*ready.remarks, *alike.remarks, *first.remarks)
    return _ImportedCase(recording, first.model, first.balances, remarks, alike.recordings[1] if before else None)


def _is_plain(wanted: RealRecording) -> bool:
    """Whether a force balance of the recording is possible: neither a given model nor a reference recording fixes its
    commands and responses."""
    return wanted.before is None and wanted.model() is None


def _model(
    wanted: RealRecording, recording: Recording, bounds: tuple[TimeBudget, Guard], on_progress: Progress
) -> FirstModel:
    """The given model, else a linear model fitted to the recording, and its force balance where there is no reference
    recording. Raises StudyError."""
    given = wanted.model()
    if given is None:
        alone = DiagnosisInput((recording,), (wanted.name,), wanted.found.files, ())
        if wanted.before is not None:
            return FirstModel(
                *fit_linear_model(alone, lambda share: on_progress("fitting a linear model", 0.1 * share))
            )
        return first_model_of(alone, (), bounds, lambda what, share: on_progress(what, 0.1 * share))
    try:
        require_model_of(given, (recording,))
    except NothingToDiagnose as refusal:
        raise not_diagnosable_error(refusal.problems) from refusal
    return FirstModel(given, ())


def _refusal(wanted: RealRecording, answer: str) -> RealAnswer:
    """The answer for a recording that is not diagnosed."""
    diagnosis = wanted.found.source.map.diagnosis
    return RealAnswer(
        folder=wanted.folder.name,
        recording=wanted.name,
        title=wanted.found.source.map.title,
        device=wanted.found.source.map.device,
        verdict="refused",
        answer=answer,
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


def _test_on_further(test: FoundMap, wanted: RealRecording, found: Findings) -> FurtherTest:
    """Test on a further recording; nothing is fitted to it except, where the map says so, its gain. The models are as
    recorded, so that the direction in which commands are counted was decided once, for all recordings of the device."""
    title, free = test.source.map.title, test.source.map.diagnosis.volume_free
    try:
        recording = import_real_recording(test)
        if _is_plain(wanted):
            (recording,) = all_as_force_driven(one_motion_per_force((recording,), turns=False)[0])
        retuned, after = (
            prediction_error(recording, model, "all") for model in (_require_retuned(found), found.improved)
        )
    except (StudyError, MechanicalModelError, ValueError, np.linalg.LinAlgError) as problem:
        text = problem.happened if isinstance(problem, StudyError) else f"{problem}."
        return FurtherTest(test.name, title, "", None, None, problem=text)
    without, with_it = (each.with_gain if free else each.without_gain for each in (retuned, after))
    text = after.error + (", one factor fitted" if free else "")
    stretches = (
        () if free or after.error == "predicted force" else _stretch_of_whole(test.name, recording, retuned, after)
    )
    return FurtherTest(test.name, title, text, without, with_it, stretches)


def _stretch_of_whole(
    name: str, recording: Recording, retuned: PredictionError, after: PredictionError
) -> tuple[HeldOutStretch, ...]:
    """The whole recording as one held-out stretch per channel, with the errors of both models."""
    seconds = len(recording) / recording.sample_rate_hz
    return tuple(
        HeldOutStretch(name, channel.name, channel.unit, 0.0, seconds, channel.signal, channel.error, with_it.error)
        for channel, with_it in zip(retuned.channels, after.channels, strict=False)
    )


def _require_retuned(found: Findings) -> MechanicalModel:
    assert found.retuned is not None
    return found.retuned


def _compare_pair(wanted: RealRecording, case: _ImportedCase, found: Findings) -> PairOutcome:
    """The recordings before and after a change of the device: what was named, and the errors of the model before and
    after it was re-tuned and effects were added."""
    assert wanted.before is not None and case.before is not None
    given = prediction_error(case.recording, case.model, "test")
    missed = prediction_error(case.before, case.model, "test")
    errors = found.diagnosis.fit.test
    return PairOutcome(
        changed=wanted.changed,
        before=_file_names(wanted.before.files),
        after=_file_names(wanted.found.files),
        verdict=found.diagnosis.verdict,
        named=describe_named(found),
        returned=found.diagnosis.returned_set,
        as_before=given.without_gain,
        gain=given.with_gain,
        retuned=errors.retuned,
        with_effects=errors.after if found.diagnosis.effects else None,
        expected_left=missed.without_gain,
    )


def _file_names(files: Sequence[Path]) -> str:
    return ", ".join(path.name for path in files)
