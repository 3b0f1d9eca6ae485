"""File locks: a session has a single writer, and participant numbers are assigned by one program at a time.

Both are locks of the operating system on a file, which it releases when the process that holds them ends: after a crash
no lock must be removed by hand.
"""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from filelock import FileLock, Timeout

from study.errors import StudyError
from study.store.disk.privacy import PRIVATE_FILE

SESSION_LOCK_NAME = "session.lock"
"""Lock file in the session's folder, held while a program writes to the session."""
PLACES_LOCK_NAME = ".places.lock"
"""Lock file in the data folder, held while a participant number (a place in the counterbalanced order) is assigned."""
PLACES_LOCK_TIMEOUT_S = 20.0
"""Longest wait for the lock `PLACES_LOCK_NAME` (s). Chosen far above the duration of an assignment, which reads logs of
the folder."""


@contextmanager
def hold_session_lock(folder: Path) -> Iterator[None]:
    """Hold the lock of the session in `folder` within the context. Raises StudyError, without waiting, where it is held
    already or the folder is not writable."""
    lock = FileLock(folder / SESSION_LOCK_NAME, mode=PRIVATE_FILE)
    try:
        lock.acquire(timeout=0)
    except Timeout as timeout:
        raise StudyError(
            "This session is running elsewhere",
            f"Another program is writing to {folder.name}.",
            "Close it there first.",
            saved="Nothing was changed.",
        ) from timeout
    except OSError as problem:
        raise StudyError(
            "The session's folder cannot be written to",
            f"{folder.name}: {problem.strerror or problem}.",
            "Check the permissions of the folder.",
            saved="Nothing was changed.",
        ) from problem
    try:
        yield
    finally:
        lock.release()


@contextmanager
def hold_places_lock(data_folder: Path) -> Iterator[None]:
    """Hold the lock of the data folder within the context, for the assignment of a participant number. Waits while
    another program holds it. Raises StudyError after `PLACES_LOCK_TIMEOUT_S`, and where the data folder is not
    writable."""
    lock = FileLock(data_folder / PLACES_LOCK_NAME, mode=PRIVATE_FILE)
    try:
        lock.acquire(timeout=PLACES_LOCK_TIMEOUT_S)
    except Timeout as timeout:
        raise StudyError(
            "No place in the order of conditions could be taken",
            f"Another program has held {PLACES_LOCK_NAME} in {data_folder} for {PLACES_LOCK_TIMEOUT_S:g} s.",
            "End the program that holds it.",
            saved="The forms are on disk; no trial was played.",
        ) from timeout
    except OSError as problem:
        raise StudyError(
            "The data folder cannot be written to",
            f"{data_folder}: {problem.strerror or problem}.",
            "Check the permissions of the folder.",
            saved="The forms are on disk; no trial was played.",
        ) from problem
    try:
        yield
    finally:
        lock.release()
