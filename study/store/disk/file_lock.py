"""Lock of the operating system on a file, which the system releases when the process that holds it ends: after a crash
no lock must be removed by hand."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from filelock import FileLock, Timeout

from study.errors import StudyError
from study.store.disk.privacy import PRIVATE_FILE


@contextmanager
def hold_file_lock(path: Path, held_error: StudyError, place: str, timeout_s: float = 0.0) -> Iterator[None]:
    """Hold the lock of a file, which is created where it is missing, within the context. Raises `held_error` where
    another process holds it for longer than `timeout_s`, and StudyError, with the same saved data, where the folder is
    not writable. place: name of the folder in that error, as the subject of a sentence."""
    lock = FileLock(path, mode=PRIVATE_FILE)
    try:
        lock.acquire(timeout=timeout_s)
    except Timeout as timeout:
        raise held_error from timeout
    except OSError as problem:
        raise StudyError(
            f"{place} cannot be written to",
            f"{path.parent}: {problem.strerror or problem}.",
            "Check the permissions of the folder.",
            saved=held_error.saved,
        ) from problem
    try:
        yield
    finally:
        lock.release()
