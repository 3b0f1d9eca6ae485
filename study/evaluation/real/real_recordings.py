"""Diagnose all recordings of a folder of real devices (`hapteq real`).

`diagnose_folder` takes the inventory, reuses the answers of an earlier run whose inputs are unchanged, diagnoses the
other recordings here or on the workers of an executor, injects faults if `RealPlan.inject` is above 0, and writes page
and table. Each answer is written as soon as it is known, so that an interrupted run can be resumed.
"""

import errno
import math
import os
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import Executor
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from tempfile import TemporaryDirectory

from analysis.diagnosis.real_answer.real_answer import RealAnswer
from analysis.diagnosis.search.time_budget import CountedBudget
from analysis.diagnosis.types import TimeBudget
from analysis.evaluation.blind_test.injected import InjectedOutcome
from study.devices.clock import Clock, RealClock
from study.errors import StudyError, UserInterruptError, WrongUseError, convert_interrupts
from study.evaluation.bank.ask_engine import Workers
from study.evaluation.real.diagnose_real import RealDiagnosis, diagnose_real, report_crash
from study.evaluation.real.inject_real import load_carriers, run_injections
from study.evaluation.real.real_folder import RealFolder, RealRecording, read_real_folder
from study.evaluation.real.reuse_answers import (
    ANSWER_NAME,
    INJECTED_NAME,
    find_reusable_answers,
    gather_answer_provenance,
    locate_answer_folder,
)
from study.evaluation.real.write_real import PAGE_NAME, RealResults, WrittenReal, write_real
from study.local_clock import convert_to_machine_zone
from study.session.views.local_time import format_time_in_zone
from study.store.disk.file_errors import CannotWriteError
from study.store.disk.folder_contents import FileContents, read_files, write_files
from study.store.disk.new_folder import create_new_folder
from study.store.disk.provenance import Provenance
from study.store.formats.mechanical_model_file import write_mechanical_model
from study.store.formats.real_answer_file import read_answer_and_provenance, write_real_answer
from study.workflows.crash_guard import make_crash_guard
from study.workflows.diagnosis.write_diagnosis import write_diagnosis_into
from study.workflows.forked_map import measure_processor_s, without_forking
from study.workflows.run_on_executor import run_tasks

RETUNED_NAME = "retuned.toml"
"""Re-tuned model, in the folder of a recording's answer."""
DIAGNOSIS_SHARE = 0.5
"""Progress, 0 to 1, at which the diagnosis ends and the injection of faults begins."""
MAX_EVALUATIONS = 4000
"""Limit of the search for one recording, counted in evaluations (a structure weighed, a law simulated or fitted). At
the limit the search ends with its best result. Evaluations are counted instead of seconds, because answers would
otherwise depend on the load of the machine."""
MAX_TASKS_IN_FLIGHT = 16
"""Most recordings in flight on an executor: each is sent with all files of its sub-folder, which are in memory until
then."""
OVERHEAD_S = 25.0
"""Processor time (s) subtracted from the time of a recording, where `RealPlan.seconds` is given: for all work other
than the search (fit of a model, page, figures)."""

Progress = Callable[[str, float], None]
"""Called with the current step in words and the fraction that is done, 0 to 1."""


@dataclass(frozen=True, slots=True)
class RealPlan:
    """Settings of `diagnose_folder`: folder of recordings, folder for the results, limit of the search, faults to
    inject."""

    folder: Path
    out: Path
    seconds: float | None = None
    """Processor time (s) for all recordings of a sub-folder together; None: evaluations are counted instead."""
    inject: int = 0
    """Number of faults to inject into the diagnosed recordings; 0 = none."""
    seed: int = 1
    """Seed of the random draws of faults."""


def diagnose_folder(
    plan: RealPlan, on_progress: Progress, clock: Clock | None = None, executor: Executor | None = None
) -> WrittenReal:
    """Diagnose all recordings of a folder, and write page and table. executor: diagnoses on its workers, which may
    share no disk; None: here. Resumable after UserInterruptError. Raises StudyError; WrongUseError for an executor
    together with `plan.seconds`."""
    if executor is not None and plan.seconds is not None:
        raise WrongUseError(
            "--seconds counts this computer's processor time",
            "With --seconds and --scheduler together, answers would depend on which worker gave them.",
            "Leave --seconds out: searches then end by a count of evaluations, the same on every machine.",
            saved="Nothing was written.",
        )
    inventory = _take_inventory(plan)
    used_clock = clock or RealClock()
    reused = find_reusable_answers(plan.out, inventory.recordings, plan.seconds)
    _make_writable(plan.out)
    saved = f"What was answered so far is in {plan.out}."
    with convert_interrupts("Not all recordings were diagnosed.", saved, further_types=(UserInterruptError,)):
        if executor is None:
            answers = _diagnose_here(plan, inventory, reused, on_progress, used_clock)
        else:
            answers = _diagnose_on_executor(plan, inventory, reused, on_progress, executor)
        injected = _inject_faults(plan, inventory, answers, on_progress, executor or 2)
        on_progress("writing the page", 0.98)
        return write_real(
            plan.out,
            RealResults(answers, inventory.troubles, injected),
            format_time_in_zone(used_clock.utc(), convert_to_machine_zone),
        )


def _take_inventory(plan: RealPlan) -> RealFolder:
    """Recordings of the folder. Raises WrongUseError for seconds that are not finite, StudyError without a
    recording."""
    if plan.seconds is not None and not math.isfinite(plan.seconds):
        raise WrongUseError(
            "This is not a valid number of seconds",
            f"--seconds is {plan.seconds}.",
            "Give a number of 1 or more, such as 180, or leave it out.",
            saved="Nothing was written.",
        )
    inventory = read_real_folder(plan.folder)
    if inventory.recordings:
        return inventory
    raise StudyError(
        "There is no recording to diagnose",
        " ".join(f"{trouble.location}: {trouble.reason}" for trouble in inventory.troubles),
        "Give a folder whose sub-folders hold recordings, as docs/real.md says.",
        saved="Nothing was written.",
    )


def _make_writable(out: Path) -> None:
    """Create the output folder before the work. Raises CannotWriteError."""
    try:
        out.mkdir(parents=True, exist_ok=True)
    except OSError as problem:
        raise CannotWriteError(out, problem) from problem
    if not os.access(out, os.W_OK | os.X_OK):
        raise CannotWriteError(out / PAGE_NAME, PermissionError(errno.EACCES, os.strerror(errno.EACCES)))


def _inject_faults(
    plan: RealPlan, inventory: RealFolder, answers: Sequence[RealAnswer], on_progress: Progress, workers: Workers
) -> tuple[InjectedOutcome, ...]:
    """Inject `plan.inject` faults into diagnosed recordings and diagnose them; no outcomes where it is 0."""
    if plan.inject == 0:
        return ()
    start_share = DIAGNOSIS_SHARE
    on_progress("injecting faults", start_share)
    carriers = load_carriers(plan.out, inventory.recordings, answers)

    def show(done: int, total: int) -> None:
        on_progress(f"injected faults, {done} of {total}", start_share + (0.98 - start_share) * done / max(total, 1))

    return run_injections(plan.out / INJECTED_NAME, carriers, (plan.inject, plan.seed), show, workers)


def _diagnose_here(
    plan: RealPlan, inventory: RealFolder, reused: Mapping[Path, RealAnswer], on_progress: Progress, clock: Clock
) -> tuple[RealAnswer, ...]:
    """Answers of all recordings in order, diagnosed here one after another; those in `reused` are reused. With
    `plan.seconds`, the remaining time of a sub-folder is divided evenly among its remaining recordings; each gets at
    least a tenth of `plan.seconds`."""
    # The last 2 % of the progress are for writing the page.
    answers, count, end_share = [], max(len(inventory.recordings), 1), DIAGNOSIS_SHARE if plan.inject else 0.98
    limit_s = plan.seconds or 0.0
    remaining_s = dict.fromkeys((listed.folder.name for listed in inventory.recordings), limit_s)
    for number, recording in enumerate(inventory.recordings):
        remaining_count = sum(candidate.folder == recording.folder for candidate in inventory.recordings[number:])
        start_s = measure_processor_s()
        budget = max(remaining_s[recording.folder.name] / remaining_count - OVERHEAD_S, 0.1 * limit_s)

        def show(step: str, share: float, number: int = number, real_recording: RealRecording = recording) -> None:
            on_progress(
                f"{real_recording.folder.name}, {real_recording.name}: {step}",
                end_share * (number + min(share, 1.0)) / count,
            )

        reused_answer = reused.get(locate_answer_folder(plan.out, recording))
        answers.append(reused_answer or _diagnose_and_write(plan, recording, budget, show, clock))
        remaining_s[recording.folder.name] -= measure_processor_s() - start_s
    return tuple(answers)


def _diagnose_on_executor(
    plan: RealPlan,
    inventory: RealFolder,
    reused: Mapping[Path, RealAnswer],
    on_progress: Progress,
    executor: Executor,
) -> tuple[RealAnswer, ...]:
    """Answers of all recordings in order; those not in `reused` are diagnosed on the workers of the executor, which
    return the files of the results."""
    answer_paths = [locate_answer_folder(plan.out, real_recording) for real_recording in inventory.recordings]
    unanswered = [
        (answer_path, real_recording)
        for answer_path, real_recording in zip(answer_paths, inventory.recordings, strict=True)
        if answer_path not in reused
    ]
    tasks = (
        (answer_path, (real_recording.folder.name, real_recording.name, read_files(real_recording.folder)))
        for answer_path, real_recording in unanswered
    )
    answers, end_share = dict(reused), DIAGNOSIS_SHARE if plan.inject else 0.98
    for answer_path, files in run_tasks(executor, answer_sent_recording, tasks, MAX_TASKS_IN_FLIGHT):
        with _new_folder_in_parents(answer_path) as part:
            write_files(part, files)
        answers[answer_path] = read_answer_and_provenance(answer_path / ANSWER_NAME)[0]
        on_progress(f"{len(answers)} of {len(answer_paths)} answered", end_share * len(answers) / len(answer_paths))
    return tuple(answers[answer_path] for answer_path in answer_paths)


def answer_sent_recording(folder: str, name: str, files: FileContents) -> FileContents:
    """Diagnose one recording on a worker, and return the files of its results. folder, files: name and content of its
    sub-folder; name: of the recording. Raises StudyError where the recording is not in these files."""
    with TemporaryDirectory() as temporary, without_forking():
        plan = RealPlan(Path(temporary) / "recordings", Path(temporary) / "out")
        write_files(plan.folder / folder, files)
        inventory = read_real_folder(plan.folder)
        real_recording = next((candidate for candidate in inventory.recordings if candidate.name == name), None)
        if real_recording is None:
            reasons = " ".join(trouble.reason for trouble in inventory.troubles)
            raise StudyError(
                "A recording did not come to its worker",
                f"{folder}, {name}: it is not among the files that were sent. {reasons}".strip(),
                "Look whether it is still in the folder, and run the same command again.",
                saved="All answers so far.",
            )
        _diagnose_and_write(plan, real_recording, 0.0, lambda step, share: None, RealClock())
        return read_files(locate_answer_folder(plan.out, real_recording))


def _diagnose_and_write(
    plan: RealPlan, real_recording: RealRecording, budget_s: float, on_progress: Progress, clock: Clock
) -> RealAnswer:
    """Diagnose one recording and write its results. budget_s: processor time for the search, used where `plan.seconds`
    is given. A crash is written as an answer, unless the crash guard is off."""
    start_s, processor_start_s, guard = clock.now_s(), measure_processor_s(), make_crash_guard()
    time_budget: TimeBudget = lambda: measure_processor_s() - processor_start_s < budget_s  # noqa: E731
    time_left = CountedBudget(MAX_EVALUATIONS) if plan.seconds is None else time_budget

    def write_result(diagnosis: RealDiagnosis) -> RealAnswer:
        answer = replace(diagnosis.answer, seconds=round(clock.now_s() - start_s, 1))
        _write_diagnosis(
            locate_answer_folder(plan.out, real_recording),
            replace(diagnosis, answer=answer),
            gather_answer_provenance(real_recording, plan.seconds),
        )
        return answer

    try:
        return write_result(diagnose_real(real_recording, time_left, guard, on_progress))
    except StudyError:
        raise
    except Exception as crash:
        if not guard.enabled:
            raise
        return write_result(report_crash(real_recording, crash))


def _write_diagnosis(folder: Path, result: RealDiagnosis, origin: Provenance) -> None:
    """Write the results of one recording atomically: the answer, and unless it was refused, diagnosis and re-tuned
    model."""
    with _new_folder_in_parents(folder) as part:
        if result.findings is not None:
            write_diagnosis_into(part, result.findings, result.parents)
            assert result.findings.retuned is not None
            write_mechanical_model(part / RETUNED_NAME, result.findings.retuned)
        write_real_answer(part / ANSWER_NAME, result.answer, origin)


@contextmanager
def _new_folder_in_parents(folder: Path) -> Iterator[Path]:
    """Open a new folder as `create_new_folder` does, and create its parents. Raises StudyError."""
    try:
        folder.parent.mkdir(parents=True, exist_ok=True)
    except OSError as problem:
        raise CannotWriteError(folder, problem) from problem
    with create_new_folder(folder) as part:
        yield part
