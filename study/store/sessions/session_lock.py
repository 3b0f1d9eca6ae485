"""One writer per session: a lock that the operating system releases when its holder ends."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from filelock import FileLock, Timeout

from study.errors import StudyError
from study.store.disk.privacy import PRIVATE_FILE

LOCK_NAME = "session.lock"
"""Lock file in the session's folder."""
PLACES_NAME = ".places.lock"
"""Lock file in the data folder, held while a participant number is taken."""
PATIENCE_S = 20.0
"""Taking a place reads the first lines of all sessions in the folder."""


@contextmanager
def hold_session_lock(folder: Path) -> Iterator[None]:
    """Hold the session's lock. Raises StudyError at once if another program holds it."""
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
    """Hold the right to take a place in the balanced order; waits for others. Raises StudyError after PATIENCE_S."""
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
    try:
        yield
    finally:
        lock.release()
