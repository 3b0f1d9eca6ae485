"""Runs the diagnosis of a bank's open cases in worker processes (`answer_cases`), each for many cases.

The processes run on this computer, or on the workers of an executor. A case is tried `TRIES` times, with a new process
where the last died or exceeded `PATIENCE_S`; then it counts as failed.
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
from study.evaluation.bank.proof_folder import ANSWER, FURTHER_RECORDING, RECORDING, WORKER_DIED, ProofFolder
from study.evaluation.bank.proof_seals import read_answer
from study.store.disk.folder_contents import Files, read_files, write_files
from study.store.disk.text_file import read_text, write_text
from study.workflows.run_on_executor import run_tasks

PATIENCE_S = 1200.0
"""Longest wait for one case (s); a case takes seconds to a minute."""
GLANCE_S = 0.5
"""Interval at which the calling thread checks that workers still run (s)."""
TRIES = 2
"""Attempts per case: a process may have died because it was killed from outside."""


class Engine:
    """One worker process, started on the first request and restarted after it died."""

    def __init__(self, folder: ProofFolder) -> None:
        self._folder = folder
        self._process: subprocess.Popen[str] | None = None
        self._lock = threading.Lock()
        self.ended = False

    def ask(self, name: str) -> bool:
        """Send one case name and block until its answer; False if the process failed, timed out or was ended."""
        with self._lock:
            if self.ended:
                return False
            if self._process is None or self._process.poll() is not None:
                self.close()
                self._process = self._start_process()
            process = self._process
        if answered := _ask_process(process, name):
            return answered
        # A process that is about to end still seems to run, and the next request would be lost with it.
        process.kill()
        process.wait()
        return answered

    def end(self) -> None:
        """Kill the process permanently; a caller that is waiting gets False."""
        with self._lock:
            self.ended = True
            if self._process is not None:
                self._process.kill()
                self._process.wait()

    def close(self) -> None:
        """Close the pipes of the process."""
        for pipe in () if self._process is None else (self._process.stdin, self._process.stdout):
            if pipe is not None:
                with suppress(OSError):
                    pipe.close()

    def _start_process(self) -> subprocess.Popen[str]:
        with self._folder.log_file.open("a", encoding="utf-8") as log:
            return subprocess.Popen(
                [sys.executable, "-m", "study.evaluation.bank.answer_cases", str(self._folder.open)],
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=log,
                text=True,
            )


def _ask_process(process: "subprocess.Popen[str]", name: str) -> bool:
    """Send a case name and wait for its echo. Kills the process after `PATIENCE_S`, which ends the wait."""
    timeout = threading.Timer(PATIENCE_S, process.kill)
    timeout.daemon = True
    timeout.start()
    try:
        if process.stdin is None or process.stdout is None:
            return False
        process.stdin.write(f"{name}\n")
        process.stdin.flush()
        return process.stdout.readline().strip() == name
    except OSError:
        return False
    finally:
        timeout.cancel()


Workers = int | Executor
"""Number of processes on this computer, or an executor to whose workers the cases are sent: they may share no disk."""


def ask_and_count(
    folder: ProofFolder,
    names: Sequence[str],
    workers: Workers,
    on_done: Callable[[int, int], None],
    *,
    keep: bool,
    diagnosable: Sequence[str] | None = None,
) -> None:
    """Diagnose the cases `names` that have no answer, calling `on_done(answered, total)`. keep: do not delete
    recordings of answered cases. diagnosable: those of `names` that can be diagnosed; None = all. Raises StudyError as
    `ask_engine`."""
    done = sum(is_answered(folder.open / name) for name in names)
    on_done(done, len(names))

    def on_answered(name: str) -> None:
        nonlocal done
        done += 1
        if not keep:
            forget_recordings(folder.open / name)
        on_done(done, len(names))

    ask_engine(folder, names if diagnosable is None else diagnosable, workers, on_answered)


def ask_engine(folder: ProofFolder, names: Sequence[str], workers: Workers, on_answered: Callable[[str], None]) -> None:
    """Diagnose the cases `names` that have no answer yet; blocks until done. `on_answered(name)` is called in this
    thread after each case. Raises StudyError if all worker processes ended early."""
    pending, answered = SimpleQueue[str](), SimpleQueue[str]()
    unanswered = [name for name in names if not is_answered(folder.open / name)]
    if isinstance(workers, Executor):
        _send_cases(folder, unanswered, workers, on_answered)
        return
    for name in unanswered:
        pending.put(name)
    with _start_engines(folder, min(workers, len(unanswered)), pending, answered) as threads:
        missing_count = len(unanswered)
        while missing_count:
            try:
                name = answered.get(timeout=GLANCE_S)
            except Empty:
                if not any(thread.is_alive() for thread in threads) and answered.empty():
                    raise _processes_ended_error(folder, missing_count) from None
                continue
            missing_count -= 1
            on_answered(name)


def _send_cases(
    folder: ProofFolder, names: Sequence[str], executor: Executor, on_answered: Callable[[str], None]
) -> None:
    """Diagnose the cases on an executor, and write the answers that it returns."""
    cases = ((name, (name, read_files(folder.open / name))) for name in names)
    for name, document in run_tasks(executor, answer_sent_case, cases):
        if document is None:
            _write_failure(folder.open / name)
        else:
            write_text(folder.open / name / ANSWER, document, overwrite=True)
        on_answered(name)


def answer_sent_case(name: str, case: Files) -> str | None:
    """Runs on a worker of an executor: the text of answer.json, from a process in a temporary folder with nothing but
    the files of the case. None if the process died or timed out at every attempt."""
    with TemporaryDirectory() as temporary:
        folder = ProofFolder(Path(temporary))
        write_files(folder.open / name, case)
        engine = Engine(folder)
        try:
            done = any(engine.ask(name) for _ in range(TRIES))
        finally:
            engine.end()
            engine.close()
        return read_text(folder.open / name / ANSWER) if done else None


@contextmanager
def _start_engines(
    folder: ProofFolder, workers: int, pending: SimpleQueue[str], answered: SimpleQueue[str]
) -> Iterator[list[threading.Thread]]:
    """Context with a thread per worker process. On exit, also by an exception, the processes are killed."""
    engines = [Engine(folder) for _ in range(workers)]
    threads = [
        threading.Thread(target=_run_worker, args=(worker, folder, pending, answered), daemon=True)
        for worker in engines
    ]
    for thread in threads:
        thread.start()
    try:
        yield threads
    finally:
        while not pending.empty():
            pending.get()
        for engine in engines:
            engine.end()
        for thread, engine in zip(threads, engines, strict=True):
            thread.join()
            engine.close()


def _run_worker(engine: Engine, folder: ProofFolder, pending: SimpleQueue[str], answered: SimpleQueue[str]) -> None:
    """Take names from `pending` until it is empty; put them into `answered` once an answer or a failure is written."""
    while True:
        try:
            name = pending.get_nowait()
        except Empty:
            return
        if not any(engine.ask(name) for _ in range(TRIES)):
            if engine.ended:
                return
            _write_failure(folder.open / name)
        answered.put(name)


def _processes_ended_error(folder: ProofFolder, missing: int) -> StudyError:
    return StudyError(
        "The processes of the diagnosis ended before their work was done",
        f"{missing} cases have no answer; the last output of the processes is in {folder.log_file}.",
        "Run the same command again: it continues where it stopped.",
        saved=f"All answers so far are in {folder.open}.",
    )


def is_answered(case_folder: Path) -> bool:
    """Whether the case has an answer. The failure of a process that died does not count, because it may have been
    killed: the next run diagnoses the case again."""
    return (case_folder / ANSWER).exists() and WORKER_DIED not in read_answer(case_folder)


def _write_failure(case_folder: Path) -> None:
    """Write an answer that says that the process died or timed out."""
    reason = f"the process died {TRIES} times, or took longer than {PATIENCE_S:g} s"
    document = {"name": case_folder.name, "failed": reason, WORKER_DIED: True}
    write_text(case_folder / ANSWER, json.dumps(document, indent=1) + "\n", overwrite=True)


def forget_recordings(case_folder: Path) -> None:
    """Delete the recordings of an answered case to save disk space; the label has their hash, and the seed reproduces
    them."""
    if is_answered(case_folder):
        for path in (case_folder / RECORDING, *case_folder.glob(FURTHER_RECORDING.format("*"))):
            with suppress(OSError):
                path.unlink(missing_ok=True)
