"""Run the diagnosis of a bank's unanswered cases in worker processes (`answer_cases`).

The processes run on this computer, each for many cases, or on the workers of an executor. A case is tried up to
`MAX_ATTEMPTS` times, with a new process where the last died or exceeded `CASE_TIMEOUT_S`; then it counts as failed.
"""

import json
import subprocess
import sys
import threading
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Executor
from contextlib import contextmanager, suppress
from pathlib import Path
from queue import Empty, SimpleQueue
from tempfile import TemporaryDirectory

from study.errors import StudyError
from study.evaluation.bank.proof_folder import (
    ANSWER_FILE,
    FURTHER_RECORDING_FILE,
    RECORDING_FILE,
    WORKER_DIED_KEY,
    ProofFolder,
)
from study.evaluation.bank.proof_seals import read_answer
from study.store.disk.folder_contents import FileContents, read_files, write_files
from study.store.disk.text_file import read_text, write_text
from study.workflows.run_on_executor import run_tasks

CASE_TIMEOUT_S = 1200.0
"""Longest wait for one case (s). Chosen: twenty times the usual limit of the search (`seal_cases.SEARCH_CPU_S`)."""
POLL_INTERVAL_S = 0.5
"""Longest single wait of the calling thread for an answer (s): on Windows it cannot be interrupted. Chosen."""
MAX_ATTEMPTS = 2
"""Attempts per case and run; the second, because a process may have been killed from outside. Chosen."""


class DiagnosisProcess:
    """A worker process that diagnoses cases one after another (`answer_cases`). It is started on the first request and
    restarted after it died."""

    def __init__(self, folder: ProofFolder) -> None:
        self._folder = folder
        self._process: subprocess.Popen[str] | None = None
        self._lock = threading.Lock()
        self.ended = False

    def request_answer(self, case_name: str) -> bool:
        """Send one case name and wait until the process has written its answer; False if the process died, timed out or
        was ended."""
        with self._lock:
            if self.ended:
                return False
            if self._process is None or self._process.poll() is not None:
                self.close()
                self._process = self._start_process()
            process = self._process
        if answered := _send_case_name(process, case_name):
            return answered
        # A process that is about to end still seems to run, and the next request would be lost with it.
        process.kill()
        process.wait()
        return answered

    def end(self) -> None:
        """Kill the process and start no other; a caller that is waiting gets False."""
        with self._lock:
            self.ended = True
            if self._process is not None:
                self._process.kill()
                self._process.wait()

    def close(self) -> None:
        """Close the pipes of the process; nothing if none was started."""
        for pipe in () if self._process is None else (self._process.stdin, self._process.stdout):
            if pipe is not None:
                with suppress(OSError):
                    pipe.close()

    def _start_process(self) -> subprocess.Popen[str]:
        """Start a process of `answer_cases` on the folder; its stderr is appended to the folder's log file."""
        with self._folder.log_file.open("a", encoding="utf-8") as log:
            return subprocess.Popen(
                [sys.executable, "-m", "study.evaluation.bank.answer_cases", str(self._folder.open)],
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=log,
                text=True,
            )


def _send_case_name(process: "subprocess.Popen[str]", case_name: str) -> bool:
    """Send a case name and wait until the process repeats it, when its answer is written. Kills the process after
    `CASE_TIMEOUT_S`, which ends the wait. Returns whether the name came back."""
    kill_timer = threading.Timer(CASE_TIMEOUT_S, process.kill)
    kill_timer.daemon = True
    kill_timer.start()
    try:
        if process.stdin is None or process.stdout is None:
            return False
        process.stdin.write(f"{case_name}\n")
        process.stdin.flush()
        return process.stdout.readline().strip() == case_name
    except OSError:
        return False
    finally:
        kill_timer.cancel()


Workers = int | Executor
"""Number of processes on this computer, or an executor to whose workers the cases are sent: they may share no disk."""


def diagnose_and_count(
    folder: ProofFolder,
    case_names: Sequence[str],
    workers: Workers,
    on_done: Callable[[int, int], None],
    *,
    keep: bool,
) -> None:
    """Diagnose the cases `case_names` that have no answer, calling `on_done(answered, total)`. keep: do not delete the
    recordings of cases that are answered now. Raises StudyError where `diagnose_cases` does."""
    answered_count = sum(is_answered(folder.open / case_name) for case_name in case_names)
    on_done(answered_count, len(case_names))

    def on_answered(case_name: str) -> None:
        """Count a case that was answered now, and delete its recordings unless `keep`."""
        nonlocal answered_count
        answered_count += 1
        if not keep:
            delete_answered_recordings(folder.open / case_name)
        on_done(answered_count, len(case_names))

    diagnose_cases(folder, case_names, workers, on_answered)


def diagnose_cases(
    folder: ProofFolder, case_names: Sequence[str], workers: Workers, on_answered: Callable[[str], None]
) -> None:
    """Diagnose the cases `case_names` that have no answer yet; blocks until done. `on_answered(case name)` is called in
    this thread after each case, also after a failed one. Raises StudyError or OSError where a case has neither answer
    nor recording, a process cannot be started or a failure not be written; with an executor, its exceptions."""
    pending_names, answered_names = SimpleQueue[str](), SimpleQueue[str | Exception]()
    unanswered_names = [case_name for case_name in case_names if not is_answered(folder.open / case_name)]
    _require_recordings(folder, unanswered_names)
    if isinstance(workers, Executor):
        _diagnose_on_executor(folder, unanswered_names, workers, on_answered)
        return
    for case_name in unanswered_names:
        pending_names.put(case_name)
    with _start_diagnosis_processes(folder, min(workers, len(unanswered_names)), pending_names, answered_names):
        missing_count = len(unanswered_names)
        while missing_count:
            try:
                answered = answered_names.get(timeout=POLL_INTERVAL_S)
            except Empty:
                continue
            if isinstance(answered, Exception):
                raise answered
            missing_count -= 1
            on_answered(answered)


def _require_recordings(folder: ProofFolder, unanswered_names: Sequence[str]) -> None:
    """Raise StudyError where the recording of a case is missing: it is deleted once the case is answered, and an answer
    that was removed later cannot be given again."""
    if missing_names := [name for name in unanswered_names if not (folder.open / name / RECORDING_FILE).exists()]:
        raise StudyError(
            "A case has neither an answer nor a recording",
            f"In {folder.open} there is no {RECORDING_FILE} of {', '.join(missing_names[:5])}.",
            f"Delete the folder {folder.path}, and run the same command again: its cases are drawn again.",
            saved="Nothing was changed.",
        )


def _diagnose_on_executor(
    folder: ProofFolder, case_names: Sequence[str], executor: Executor, on_answered: Callable[[str], None]
) -> None:
    """Diagnose the cases on an executor, and write the answers that it returns; a failure where it returns none."""
    cases = ((case_name, (case_name, read_files(folder.open / case_name))) for case_name in case_names)
    for case_name, answer_text in run_tasks(executor, diagnose_sent_case, cases):
        if answer_text is None:
            _write_failed_answer(folder.open / case_name)
        else:
            write_text(folder.open / case_name / ANSWER_FILE, answer_text, overwrite=True)
        on_answered(case_name)


def diagnose_sent_case(case_name: str, case_files: FileContents) -> str | None:
    """Diagnose a case on a worker of an executor. Returns the text of answer.json, from a process in a temporary folder
    with nothing but the files of the case. None if the process died or timed out at every attempt."""
    with TemporaryDirectory() as temporary:
        folder = ProofFolder(Path(temporary))
        write_files(folder.open / case_name, case_files)
        diagnosis_process = DiagnosisProcess(folder)
        try:
            is_done = any(diagnosis_process.request_answer(case_name) for _ in range(MAX_ATTEMPTS))
        finally:
            diagnosis_process.end()
            diagnosis_process.close()
        return read_text(folder.open / case_name / ANSWER_FILE) if is_done else None


@contextmanager
def _start_diagnosis_processes(
    folder: ProofFolder,
    worker_count: int,
    pending_names: SimpleQueue[str],
    answered_names: SimpleQueue[str | Exception],
) -> Iterator[None]:
    """Context with a thread per worker process (`_request_pending_answers`). On exit, also by an exception, the pending
    names are dropped and the processes killed."""
    diagnosis_processes = [DiagnosisProcess(folder) for _ in range(worker_count)]
    threads = [
        threading.Thread(
            target=_request_pending_answers, args=(new_process, folder, pending_names, answered_names), daemon=True
        )
        for new_process in diagnosis_processes
    ]
    for thread in threads:
        thread.start()
    try:
        yield
    finally:
        with suppress(Empty):
            while True:
                pending_names.get_nowait()
        for diagnosis_process in diagnosis_processes:
            diagnosis_process.end()
        for thread, diagnosis_process in zip(threads, diagnosis_processes, strict=True):
            thread.join()
            diagnosis_process.close()


def _request_pending_answers(
    diagnosis_process: DiagnosisProcess,
    folder: ProofFolder,
    pending_names: SimpleQueue[str],
    answered_names: SimpleQueue[str | Exception],
) -> None:
    """Request the answer of each name from `pending_names` until it is empty; put it into `answered_names` once an
    answer or a failure is written. Returns early, without a failure, where the process was ended by `end`, and after an
    exception, which is put into `answered_names`."""
    try:
        while True:
            case_name = pending_names.get_nowait()
            if not any(diagnosis_process.request_answer(case_name) for _ in range(MAX_ATTEMPTS)):
                if diagnosis_process.ended:
                    return
                _write_failed_answer(folder.open / case_name)
            answered_names.put(case_name)
    except Empty:
        return
    except Exception as problem:  # noqa: BLE001 - raised again in the thread that waits for the answers
        answered_names.put(problem)


def is_answered(case_folder: Path) -> bool:
    """Whether the case has an answer. The failure of a process that died does not count, because it may have been
    killed: the next run diagnoses the case again."""
    return (case_folder / ANSWER_FILE).exists() and WORKER_DIED_KEY not in read_answer(case_folder)


def _write_failed_answer(case_folder: Path) -> None:
    """Write an answer that says that the process died or timed out."""
    reason = f"the process died {MAX_ATTEMPTS} times, or took longer than {CASE_TIMEOUT_S:g} s"
    document = {"name": case_folder.name, "failed": reason, WORKER_DIED_KEY: True}
    write_text(case_folder / ANSWER_FILE, json.dumps(document, indent=1) + "\n", overwrite=True)


def delete_answered_recordings(case_folder: Path) -> None:
    """Delete the recordings of an answered case, but not its clean ones, to save disk space, and ignore errors; nothing
    for an unanswered one."""
    if is_answered(case_folder):
        for path in (case_folder / RECORDING_FILE, *case_folder.glob(FURTHER_RECORDING_FILE.format("*"))):
            with suppress(OSError):
                path.unlink(missing_ok=True)
