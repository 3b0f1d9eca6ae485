"""Lock of the operating system on a file, which the system releases when the process that holds it ends: after a crash
no lock must be removed by hand."""

import errno
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from filelock import FileLock, Timeout

from study.errors import StudyError
from study.store.disk.privacy import PRIVATE_FILE

_NO_LOCKS_ERRORS = (errno.ENOLCK, errno.EOPNOTSUPP, errno.ENOTSUP, errno.ENOSYS)
"""Errors of a file system that has no locks, such as some network drives."""


@contextmanager
def hold_file_lock(path: Path, held_error: StudyError, place: str, timeout_s: float = 0.0) -> Iterator[None]:
    """Hold the lock of a file, which is created where it is missing, within the context. Raises `held_error` where
    another process holds it for longer than `timeout_s`, and StudyError, with the same saved data, where the folder is
    not writable or its file system has no locks. place: name of the folder in that error, subject of a sentence."""
    # Never a lock by the mere existence of a file, which remains after a crash.
    lock = FileLock(path, mode=PRIVATE_FILE, fallback_to_soft=False)
    try:
        lock.acquire(timeout=timeout_s)
    except Timeout as timeout:
        raise held_error from timeout
    except OSError as problem:
        if problem.errno in _NO_LOCKS_ERRORS:
            title, remedy = (
                "cannot be locked",
                "Its file system offers no file locks, as some network drives: move the data to a local disk, or have "
                "the drive mounted with locks.",
            )
        else:
            title, remedy = "cannot be written to", "Check the permissions of the folder."
        raise StudyError(
            f"{place} {title}", f"{path.parent}: {problem.strerror or problem}.", remedy, saved=held_error.saved
        ) from problem
    try:
        yield
    finally:
        lock.release()
