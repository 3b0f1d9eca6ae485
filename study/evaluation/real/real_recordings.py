"""Diagnose all recordings of a folder of real devices (`hapteq real`).

`diagnose_folder` lists the recordings, reuses the answers of an earlier run whose inputs are unchanged, diagnoses the
other recordings in this process or on the workers of an executor, injects faults if `RealPlan.inject` is above 0, and
writes page and table. Each answer is written as soon as it is known, so that an interrupted run can be resumed. The
last 2 % of the progress are for page and table.
"""

import errno
import math
import os
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Executor
from contextlib import AbstractContextManager
from dataclasses import dataclass, replace
from pathlib import Path
from tempfile import TemporaryDirectory

from analysis.diagnosis.real_answer.real_answer import RealAnswer
from analysis.diagnosis.search.time_budget import CountedBudget
from analysis.diagnosis.types import TimeBudget
from analysis.evaluation.blind_test.injected_faults import InjectedOutcome
from study.devices.clock import Clock, RealClock
from study.errors import StudyError, UserInterruptError, WrongUseError, convert_interrupts
from study.evaluation.bank.ask_engine import Workers
from study.evaluation.real.diagnose_real import RealDiagnosis, diagnose_real, make_crash_result
from study.evaluation.real.inject_real import load_injectable_recordings, run_injections
from study.evaluation.real.real_folder import RealFolder, RealRecording, read_real_folder
from study.evaluation.real.reuse_answers import (
    ANSWER_NAME,
    INJECTED_NAME,
    find_reusable_answers,
    gather_answer_provenance,
    locate_answer_folder,
)
from study.evaluation.real.write_real import (
    INJECTED_TABLE_NAME,
    PAGE_NAME,
    TABLE_NAME,
    RealResults,
    WrittenReal,
    write_real_results,
)
from study.local_clock import convert_to_machine_zone
from study.session.views.local_time import format_time_in_zone
from study.store.disk.file_errors import CannotWriteError, convert_write_errors
from study.store.disk.folder_contents import FileContents, read_files, write_files
from study.store.disk.new_folder import create_new_folder
from study.store.disk.provenance import Provenance
from study.store.formats.mechanical_model_file import write_mechanical_model
from study.store.formats.real_answer_file import read_answer_and_provenance, write_real_answer
from study.workflows.crash_guard import make_crash_guard
from study.workflows.diagnosis.write_diagnosis import write_diagnosis_into
from study.workflows.forked_map import disable_forking, measure_processor_s
from study.workflows.run_on_executor import run_tasks

RETUNED_NAME = "retuned.toml"
"""File name of the re-tuned model, in the folder of a recording's answer."""
DIAGNOSIS_SHARE = 0.5
"""Progress, 0 to 1, at which the injection of faults begins, if there is one. Chosen."""
MAX_EVALUATIONS = 4000
"""Largest number of evaluations (structures compared, laws simulated or fitted) in the search for one recording, which
then ends with its best result. Chosen. A limit in seconds would make answers depend on the load of the machine."""
MAX_TASKS_IN_FLIGHT = 16
"""Largest number of recordings submitted to an executor at a time, with all files of their sub-folders. Chosen."""
OVERHEAD_S = 25.0
"""Processor time (s) per recording for all work other than the search (fit of a model, page, figures), where
`RealPlan.seconds` is given. Chosen."""

Progress = Callable[[str, float], None]
"""Called with a description of the current step and the fraction that is done, 0 to 1."""


@dataclass(frozen=True, slots=True)
class RealPlan:
    """Settings of `diagnose_folder`. folder: of recordings; out: folder for the results."""

    folder: Path
    out: Path
    seconds: float | None = None
    """Processor time (s) for all recordings of a sub-folder together; None: evaluations are counted instead."""
    inject: int = 0
    """Number of cases of the test with injected faults, about half of which have no fault (`inject_real`); 0 = none."""
    seed: int = 1
    """Seed of the random draws of these cases."""


def diagnose_folder(
    plan: RealPlan, on_progress: Progress, clock: Clock | None = None, executor: Executor | None = None
) -> WrittenReal:
    """Diagnose all recordings of a folder, and write page and table. executor: its workers, which may share no disk,
    diagnose; None: this process does, and two others diagnose the cases with injected faults. Resumable after
    UserInterruptError. Raises StudyError; WrongUseError for `plan.seconds` with an executor or not finite."""
    if executor is not None and plan.seconds is not None:
        raise WrongUseError(
            "--seconds counts this computer's processor time",
            "With --seconds and --scheduler together, answers would depend on which worker gave them.",
            "Leave --seconds out: searches then end by a count of evaluations, the same on every machine.",
            saved="Nothing was written.",
        )
    real_folder = _list_recordings(plan)
    used_clock = clock or RealClock()
    reused_answers = find_reusable_answers(plan.out, real_folder.recordings, plan.seconds)
    _create_output_folder(plan.out)
    saved_text = f"What was answered so far is in {plan.out}."
    with convert_interrupts("Not all recordings were diagnosed.", saved_text, further_types=(UserInterruptError,)):
        if executor is None:
            answers = _diagnose_in_process(plan, real_folder, reused_answers, on_progress, used_clock)
        else:
            answers = _diagnose_on_executor(plan, real_folder, reused_answers, on_progress, executor)
        injected = _inject_faults(plan, real_folder, answers, on_progress, executor or 2)
        on_progress("writing the page", 0.98)
        return write_real_results(
            plan.out,
            RealResults(answers, real_folder.troubles, injected),
            format_time_in_zone(used_clock.utc(), convert_to_machine_zone),
        )


def _list_recordings(plan: RealPlan) -> RealFolder:
    """List the recordings of the folder. Raises WrongUseError for seconds that are not finite, StudyError without a
    recording or where a sub-folder has the name of a result."""
    if plan.seconds is not None and not math.isfinite(plan.seconds):
        raise WrongUseError(
            "This is not a valid number of seconds",
            f"--seconds is {plan.seconds}.",
            "Give a number of 1 or more, such as 180, or leave it out.",
            saved="Nothing was written.",
        )
    real_folder = read_real_folder(plan.folder, plan.out)
    result_names = {PAGE_NAME, TABLE_NAME, INJECTED_TABLE_NAME, *((INJECTED_NAME,) if plan.inject else ())}
    folder_names = {recording.folder.name for recording in real_folder.recordings}
    if taken_names := sorted(name for name in folder_names if name.lower() in result_names):
        raise StudyError(
            "A sub-folder has the name of a result",
            f"In {plan.out}, {', '.join(taken_names)} would hold the results of that sub-folder and of all.",
            f"Rename the sub-folder, and likewise the folder of its results in {plan.out}, if there is one.",
            saved="Nothing was written.",
        )
    if real_folder.recordings:
        return real_folder
    raise StudyError(
        "There is no recording to diagnose",
        " ".join(f"{trouble.location}: {trouble.reason}" for trouble in real_folder.troubles),
        "Give a folder whose sub-folders hold recordings, as docs/real.md says.",
        saved="Nothing was written.",
    )


def _create_output_folder(out: Path) -> None:
    """Create the output folder before any diagnosis. Raises CannotWriteError, also where it is not writable."""
    with convert_write_errors(out):
        out.mkdir(parents=True, exist_ok=True)
    if not os.access(out, os.W_OK | os.X_OK):
        raise CannotWriteError(out / PAGE_NAME, PermissionError(errno.EACCES, os.strerror(errno.EACCES)))


def _inject_faults(
    plan: RealPlan, real_folder: RealFolder, answers: Sequence[RealAnswer], on_progress: Progress, workers: Workers
) -> tuple[InjectedOutcome, ...]:
    """Make `plan.inject` cases of diagnosed recordings and injected faults, and diagnose them; empty where it is 0."""
    if plan.inject == 0:
        return ()
    on_progress("injecting faults", DIAGNOSIS_SHARE)
    return run_injections(
        plan.out / INJECTED_NAME,
        load_injectable_recordings(plan.out, real_folder.recordings, answers),
        (plan.inject, plan.seed),
        lambda done, total: on_progress(
            f"injected faults, {done} of {total}", DIAGNOSIS_SHARE + (0.98 - DIAGNOSIS_SHARE) * done / total
        ),
        workers,
    )


def _diagnose_in_process(
    plan: RealPlan,
    real_folder: RealFolder,
    reused_answers: Mapping[Path, RealAnswer],
    on_progress: Progress,
    clock: Clock,
) -> tuple[RealAnswer, ...]:
    """Diagnose the recordings in order in this process, except those in `reused_answers` (by answer folder); returns
    all answers in order. With `plan.seconds`, the remaining time of a sub-folder is divided evenly among its
    remaining recordings, less `OVERHEAD_S` each; each gets at least a tenth of `plan.seconds`."""
    answers, end_share, limit_s = [], DIAGNOSIS_SHARE if plan.inject else 0.98, plan.seconds or 0.0
    remaining_s = dict.fromkeys((listed_recording.folder.name for listed_recording in real_folder.recordings), limit_s)
    for index, recording in enumerate(real_folder.recordings):
        remaining_count = sum(candidate.folder == recording.folder for candidate in real_folder.recordings[index:])
        start_s = measure_processor_s()
        budget_s = max(remaining_s[recording.folder.name] / remaining_count - OVERHEAD_S, 0.1 * limit_s)

        def report_progress(
            step: str, share: float, index: int = index, real_recording: RealRecording = recording
        ) -> None:
            on_progress(
                f"{real_recording.folder.name}, {real_recording.name}: {step}",
                end_share * (index + min(share, 1.0)) / len(real_folder.recordings),
            )

        reused_answer = reused_answers.get(locate_answer_folder(plan.out, recording))
        answers.append(reused_answer or _diagnose_and_write(plan, recording, budget_s, report_progress, clock))
        remaining_s[recording.folder.name] -= measure_processor_s() - start_s
    return tuple(answers)


def _diagnose_on_executor(
    plan: RealPlan,
    real_folder: RealFolder,
    reused_answers: Mapping[Path, RealAnswer],
    on_progress: Progress,
    executor: Executor,
) -> tuple[RealAnswer, ...]:
    """Diagnose the recordings without an answer in `reused_answers` on the workers of the executor, which return the
    files of the results; returns all answers in order."""
    answer_paths = [locate_answer_folder(plan.out, real_recording) for real_recording in real_folder.recordings]
    tasks = (
        (answer_path, (real_recording.folder.name, real_recording.name, read_files(real_recording.folder)))
        for answer_path, real_recording in zip(answer_paths, real_folder.recordings, strict=True)
        if answer_path not in reused_answers
    )
    answers, end_share = dict(reused_answers), DIAGNOSIS_SHARE if plan.inject else 0.98
    for answer_path, files in run_tasks(executor, diagnose_sent_recording, tasks, MAX_TASKS_IN_FLIGHT):
        with _create_folder_with_parents(answer_path) as answer_folder:
            write_files(answer_folder, files)
        answers[answer_path] = read_answer_and_provenance(answer_path / ANSWER_NAME)[0]
        on_progress(f"{len(answers)} of {len(answer_paths)} answered", end_share * len(answers) / len(answer_paths))
    return tuple(answers[answer_path] for answer_path in answer_paths)


def diagnose_sent_recording(folder: str, name: str, files: FileContents) -> FileContents:
    """Diagnose one recording on a worker, and return the files of its results. folder, files: name and files of its
    sub-folder; name: of the recording. Raises StudyError where the recording is not in these files."""
    with TemporaryDirectory() as temporary, disable_forking():
        plan = RealPlan(Path(temporary) / "recordings", Path(temporary) / "out")
        write_files(plan.folder / folder, files)
        real_folder = read_real_folder(plan.folder)
        real_recording = next((candidate for candidate in real_folder.recordings if candidate.name == name), None)
        if real_recording is None:
            reasons = " ".join(trouble.reason for trouble in real_folder.troubles)
            raise StudyError(
                "A recording did not come to its worker",
                f"{folder}, {name}: it is not among the files that were sent. {reasons}".strip(),
                "Look whether it is still in the folder, and run the same command again.",
                saved="All answers so far are kept.",
            )
        _diagnose_and_write(plan, real_recording, 0.0, lambda step, share: None, RealClock())
        return read_files(locate_answer_folder(plan.out, real_recording))


def _diagnose_and_write(
    plan: RealPlan, real_recording: RealRecording, budget_s: float, on_progress: Progress, clock: Clock
) -> RealAnswer:
    """Diagnose one recording and write its results. budget_s: processor time (s) for the search, used where
    `plan.seconds` is given. An unexpected exception is written as an answer, or raised where the crash guard is off;
    StudyError is raised."""
    start_s, processor_start_s, guard = clock.now_s(), measure_processor_s(), make_crash_guard()
    time_budget: TimeBudget = lambda: measure_processor_s() - processor_start_s < budget_s  # noqa: E731
    has_time_left = CountedBudget(MAX_EVALUATIONS) if plan.seconds is None else time_budget

    def write_result(diagnosis: RealDiagnosis) -> RealAnswer:
        """Write a result with the elapsed time (s), and return its answer."""
        answer = replace(diagnosis.answer, seconds=round(clock.now_s() - start_s, 1))
        _write_diagnosis(
            locate_answer_folder(plan.out, real_recording),
            replace(diagnosis, answer=answer),
            gather_answer_provenance(real_recording, plan.seconds),
        )
        return answer

    try:
        return write_result(diagnose_real(real_recording, has_time_left, guard, on_progress))
    except StudyError:
        raise
    except Exception as crash:
        if not guard.enabled:
            raise
        return write_result(make_crash_result(real_recording, crash))


def _write_diagnosis(folder: Path, result: RealDiagnosis, origin: Provenance) -> None:
    """Write the results of one recording atomically: the answer and, where a diagnosis was made, the diagnosis and the
    re-tuned model."""
    with _create_folder_with_parents(folder) as answer_folder:
        if result.findings is not None:
            write_diagnosis_into(answer_folder, result.findings, result.parents)
            assert result.findings.retuned is not None
            write_mechanical_model(answer_folder / RETUNED_NAME, result.findings.retuned)
        write_real_answer(answer_folder / ANSWER_NAME, result.answer, origin)


def _create_folder_with_parents(folder: Path) -> AbstractContextManager[Path]:
    """Create a new folder as `create_new_folder` does, and its parents. Raises StudyError."""
    with convert_write_errors(folder):
        folder.parent.mkdir(parents=True, exist_ok=True)
    return create_new_folder(folder)
