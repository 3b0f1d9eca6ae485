"""Validate files in a separate process, because a damaged HDF5 file can crash or hang the library that reads it."""

from collections.abc import Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from multiprocessing import get_context
from pathlib import Path

from study.errors import StudyError
from study.workflows.files.validate import Validation, validate_file

FILE_TIMEOUT_S = 60.0
"""Longest wait for one file (s). Chosen: a recording of an hour takes seconds."""
START_TIMEOUT_S = 300.0
"""Longest wait for the start and imports of the worker process (s). Chosen: a computer that swaps memory takes a
minute."""


def validate_files(paths: Sequence[Path], timeout_s: float = FILE_TIMEOUT_S) -> Iterator[Validation]:
    """Validate each file, in order, and yield its result. timeout_s: longest wait for one file (s). The worker process
    is replaced when a file crashes it or takes too long. Raises StudyError where no worker starts."""
    worker = _start_worker()
    try:
        for path in paths:
            try:
                yield worker.submit(_validate_safely, path).result(timeout=timeout_s)
            except BrokenProcessPool:
                yield _make_damage_report(path, "reading it crashes the HDF5 library")
                worker = _start_worker()
            except TimeoutError:
                yield _make_damage_report(path, f"reading it does not end within {timeout_s:g} s")
                _kill_worker(worker)
                worker = _start_worker()
    finally:
        worker.shutdown(wait=False, cancel_futures=True)


def _validate_safely(path: Path) -> Validation:
    """Validate a file in the worker process. An error of hapteq itself is reported as such, not as a damaged file."""
    try:
        return validate_file(path)
    except Exception as error:  # noqa: BLE001 - a file must not be called damaged for an error in hapteq
        return Validation(path, "unknown", (f"hapteq failed on this file ({type(error).__name__}: {error}).",))


def _start_worker() -> ProcessPoolExecutor:
    """Start a worker process, and wait until its imports are done. Raises StudyError where it does not start."""
    # Spawned, not forked: a forked process would inherit locks of the HDF5 library.
    worker = ProcessPoolExecutor(max_workers=1, mp_context=get_context("spawn"))
    # Started before the first file, so that a slow start is not counted against that file's time.
    try:
        worker.submit(_confirm_start).result(timeout=START_TIMEOUT_S)
    except (BrokenProcessPool, TimeoutError) as error:
        _kill_worker(worker)
        raise StudyError(
            "Files cannot be validated",
            "The process that reads them does not start.",
            "Close other programs, and validate again.",
            saved="Nothing was written.",
        ) from error
    return worker


def _confirm_start() -> None:
    """Do nothing, as the first task of a worker: its result shows that the worker's imports are done."""


def _kill_worker(worker: ProcessPoolExecutor) -> None:
    """End the worker process at once, even if it hangs."""
    for process in list(worker._processes.values()):  # noqa: SLF001 - the executor offers no other way before 3.14
        process.kill()
    worker.shutdown(wait=False, cancel_futures=True)


def _make_damage_report(path: Path, failure: str) -> Validation:
    """Make the report on a file on which the worker crashed or did not end. failure: what happened, as a clause."""
    return Validation(path, "damaged file", (f"The file is damaged: {failure}. Restore it from a copy.",))
