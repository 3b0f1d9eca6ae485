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
from study.errors import StudyError, UserInterruptError, WrongUseError, resumable
from study.evaluation.bank.ask_engine import Workers
from study.evaluation.real.diagnose_real import RealDiagnosis, diagnose_real, report_crash
from study.evaluation.real.inject_real import carriers, run_injections
from study.evaluation.real.real_folder import RealFolder, RealRecording, read_real_folder
from study.evaluation.real.reuse_answers import (
    ANSWER_NAME,
    INJECTED_NAME,
    answer_place,
    origin_of_answer,
    reusable_answers,
)
from study.evaluation.real.write_real import PAGE_NAME, RealResults, WrittenReal, write_real
from study.local_clock import machine_zone
from study.session.views.local_time import local_time
from study.store.disk.file_errors import CannotWriteError
from study.store.disk.folder_contents import Files, read_files, write_files
from study.store.disk.new_folder import new_folder
from study.store.disk.provenance import Provenance
from study.store.formats.mechanical_model_file import write_mechanical_model
from study.store.formats.real_answer_file import read_answer_and_origin, write_real_answer
from study.workflows.crash_guard import crash_guard
from study.workflows.diagnosis.write_diagnosis import write_diagnosis_into
from study.workflows.forked_map import processor_s, without_forking
from study.workflows.run_on_executor import run_pieces

RETUNED_NAME = "retuned.toml"
"""Re-tuned model, in the folder of a recording's answer."""
DIAGNOSED_OF_BOTH = 0.5
"""Progress, 0 to 1, at which the diagnosis ends and the injection of faults begins."""
EVALUATIONS = 4000
"""Limit of the search for one recording, counted in evaluations (a structure weighed, a law simulated or fitted). At
the limit the search ends with its best result. Evaluations are counted instead of seconds, because answers would
otherwise depend on the load of the machine."""
FOLDERS_AHEAD = 16
"""Most recordings in flight on an executor: each is sent with all files of its sub-folder, which are in memory until
then."""
BESIDE_S = 25.0
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
    found = _take_inventory(plan)
    time = clock or RealClock()
    kept = reusable_answers(plan.out, found.recordings, plan.seconds)
    _make_writable(plan.out)
    saved = f"What was answered so far is in {plan.out}."
    with resumable("Not all recordings were diagnosed.", saved, also=(UserInterruptError,)):
        if executor is None:
            answers = _answers(plan, found, kept, on_progress, time)
        else:
            answers = _sent_answers(plan, found, kept, on_progress, executor)
        injected = _inject_faults(plan, found, answers, on_progress, executor or 2)
        on_progress("writing the page", 0.98)
        return write_real(
            plan.out, RealResults(answers, found.troubles, injected), local_time(time.utc(), machine_zone)
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
    found = read_real_folder(plan.folder)
    if found.recordings:
        return found
    raise StudyError(
        "There is no recording to diagnose",
        " ".join(f"{trouble.where}: {trouble.why}" for trouble in found.troubles),
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
    plan: RealPlan, found: RealFolder, answers: Sequence[RealAnswer], on_progress: Progress, workers: Workers
) -> tuple[InjectedOutcome, ...]:
    """Inject `plan.inject` faults into diagnosed recordings and diagnose them; no outcomes where it is 0."""
    if plan.inject == 0:
        return ()
    begun = DIAGNOSED_OF_BOTH
    on_progress("injecting faults", begun)
    carried = carriers(plan.out, found.recordings, answers)

    def show(done: int, of: int) -> None:
        on_progress(f"injected faults, {done} of {of}", begun + (0.98 - begun) * done / max(of, 1))

    return run_injections(plan.out / INJECTED_NAME, carried, (plan.inject, plan.seed), show, workers)


def _answers(
    plan: RealPlan, found: RealFolder, kept: Mapping[Path, RealAnswer], on_progress: Progress, clock: Clock
) -> tuple[RealAnswer, ...]:
    # The last 2 % of the progress are for writing the page.
    """Answers of all recordings in order, diagnosed here one after another; those in `kept` are reused. With
    `plan.seconds`, the remaining time of a sub-folder is divided evenly among its remaining recordings; each gets at
    least a tenth of `plan.seconds`."""
    answers, count, end = [], max(len(found.recordings), 1), DIAGNOSED_OF_BOTH if plan.inject else 0.98
    whole = plan.seconds or 0.0
    left = dict.fromkeys((each.folder.name for each in found.recordings), whole)
    for number, recording in enumerate(found.recordings):
        rest = sum(other.folder == recording.folder for other in found.recordings[number:])
        begun = processor_s()
        budget = max(left[recording.folder.name] / rest - BESIDE_S, 0.1 * whole)

        def show(what: str, share: float, number: int = number, real_recording: RealRecording = recording) -> None:
            on_progress(
                f"{real_recording.folder.name}, {real_recording.name}: {what}", end * (number + min(share, 1.0)) / count
            )

        there = kept.get(answer_place(plan.out, recording))
        answers.append(there or _answer(plan, recording, budget, show, clock))
        left[recording.folder.name] -= processor_s() - begun
    return tuple(answers)


def _sent_answers(
    plan: RealPlan,
    found: RealFolder,
    kept: Mapping[Path, RealAnswer],
    on_progress: Progress,
    executor: Executor,
) -> tuple[RealAnswer, ...]:
    """Answers of all recordings in order; those not in `kept` are diagnosed on the workers of the executor, which
    return the files of the results."""
    places = [answer_place(plan.out, each) for each in found.recordings]
    left = [(place, each) for place, each in zip(places, found.recordings, strict=True) if place not in kept]
    sent = ((place, (each.folder.name, each.name, read_files(each.folder))) for place, each in left)
    answers, end = dict(kept), DIAGNOSED_OF_BOTH if plan.inject else 0.98
    for place, files in run_pieces(executor, answer_sent_recording, sent, FOLDERS_AHEAD):
        with _new_folder_in_parents(place) as part:
            write_files(part, files)
        answers[place] = read_answer_and_origin(place / ANSWER_NAME)[0]
        on_progress(f"{len(answers)} of {len(places)} answered", end * len(answers) / len(places))
    return tuple(answers[place] for place in places)


def answer_sent_recording(folder: str, name: str, files: Files) -> Files:
    """Diagnose one recording on a worker, and return the files of its results. folder, files: name and content of its
    sub-folder; name: of the recording. Raises StudyError where the recording is not in these files."""
    with TemporaryDirectory() as place, without_forking():
        plan = RealPlan(Path(place) / "recordings", Path(place) / "out")
        write_files(plan.folder / folder, files)
        found = read_real_folder(plan.folder)
        wanted = next((each for each in found.recordings if each.name == name), None)
        if wanted is None:
            why = " ".join(trouble.why for trouble in found.troubles)
            raise StudyError(
                "A recording did not come to its worker",
                f"{folder}, {name}: it is not among the files that were sent. {why}".strip(),
                "Look whether it is still in the folder, and run the same command again.",
                saved="All answers so far.",
            )
        _answer(plan, wanted, 0.0, lambda what, share: None, RealClock())
        return read_files(answer_place(plan.out, wanted))


def _answer(
    plan: RealPlan, real_recording: RealRecording, budget_s: float, on_progress: Progress, clock: Clock
) -> RealAnswer:
    """Diagnose one recording and write its results. budget_s: processor time for the search, used where `plan.seconds`
    is given. A crash is written as an answer, unless the crash guard is off."""
    begun_s, worked, guard = clock.now_s(), processor_s(), crash_guard()
    timed: TimeBudget = lambda: processor_s() - worked < budget_s  # noqa: E731
    time_left = CountedBudget(EVALUATIONS) if plan.seconds is None else timed

    def kept(done: RealDiagnosis) -> RealAnswer:
        answer = replace(done.answer, seconds=round(clock.now_s() - begun_s, 1))
        _write(
            answer_place(plan.out, real_recording),
            replace(done, answer=answer),
            origin_of_answer(real_recording, plan.seconds),
        )
        return answer

    try:
        return kept(diagnose_real(real_recording, time_left, guard, on_progress))
    except StudyError:
        raise
    except Exception as crash:
        if not guard.on:
            raise
        return kept(report_crash(real_recording, crash))


def _write(folder: Path, done: RealDiagnosis, origin: Provenance) -> None:
    """Write the results of one recording atomically: the answer, and unless it was refused, diagnosis and re-tuned
    model."""
    with _new_folder_in_parents(folder) as part:
        if done.findings is not None:
            write_diagnosis_into(part, done.findings, done.parents)
            assert done.findings.retuned is not None
            write_mechanical_model(part / RETUNED_NAME, done.findings.retuned)
        write_real_answer(part / ANSWER_NAME, done.answer, origin)


@contextmanager
def _new_folder_in_parents(folder: Path) -> Iterator[Path]:
    """Open a new folder as `new_folder` does, and create its parents. Raises StudyError."""
    try:
        folder.parent.mkdir(parents=True, exist_ok=True)
    except OSError as problem:
        raise CannotWriteError(folder, problem) from problem
    with new_folder(folder) as part:
        yield part
