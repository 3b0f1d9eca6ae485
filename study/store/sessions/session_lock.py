"""Locks that give a session a single writer, and that serialise the assignment of participant numbers.

Both are locks of the operating system on a file, which it releases when the process that holds them ends: a crash
leaves no lock that must be removed by hand.
"""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from filelock import FileLock, Timeout

from study.errors import StudyError
from study.store.disk.privacy import PRIVATE_FILE

LOCK_NAME = "session.lock"
"""Lock file in the session's folder, held while a program writes to the session."""
PLACES_NAME = ".places.lock"
"""Lock file in the data folder, held while a participant number (a place in the balanced order) is assigned."""
PATIENCE_S = 20.0
"""Longest wait for that lock (s). It must exceed the duration of an assignment, which reads the first lines of all
sessions in the folder."""


@contextmanager
def hold_session_lock(folder: Path) -> Iterator[None]:
    """Hold the session's lock. Raises StudyError, without waiting, if another program holds it or the folder is not
    writable."""
    lock = FileLock(folder / LOCK_NAME, mode=PRIVATE_FILE)
    try:
        lock.acquire(timeout=0)
    except Timeout as held:
        raise StudyError(
            "This session is running elsewhere",
            f"Another program is writing to {folder.name}.",
            "Close it there first.",
            saved="Nothing was changed.",
        ) from held
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
def hold_places_lock(data: Path) -> Iterator[None]:
    """Hold the lock under which a place in the balanced order of conditions is assigned. Waits while another program
    holds it; raises StudyError after `PATIENCE_S`, and where the data folder cannot be written to."""
    lock = FileLock(data / PLACES_NAME, mode=PRIVATE_FILE)
    try:
        lock.acquire(timeout=PATIENCE_S)
    except Timeout as held:
        raise StudyError(
            "No place in the order of conditions could be taken",
            f"Another program has held {PLACES_NAME} in {data} for {PATIENCE_S:g} s.",
            "End the program that holds it.",
            saved="The forms are on disk; no trial was played.",
        ) from held
    except OSError as problem:
        raise StudyError(
            "The data folder cannot be written to",
            f"{data}: {problem.strerror or problem}.",
            "Check the permissions of the folder.",
            saved="The forms are on disk; no trial was played.",
        ) from problem
    try:
        yield
    finally:
        lock.release()
