"""File locks: a session has a single writer, and participant numbers are assigned by one program at a time."""

from contextlib import AbstractContextManager
from pathlib import Path

from study.errors import StudyError
from study.store.disk.file_lock import hold_file_lock

SESSION_LOCK_NAME = "session.lock"
"""Lock file in the session's folder, held while a program writes to the session."""
PLACES_LOCK_NAME = ".places.lock"
"""Lock file in the data folder, held while a participant number (a place in the counterbalanced order) is assigned."""
PLACES_LOCK_TIMEOUT_S = 20.0
"""Longest wait for the lock `PLACES_LOCK_NAME` (s). Chosen far above the duration of an assignment, which reads logs of
the folder."""


def hold_session_lock(folder: Path) -> AbstractContextManager[None]:
    """Hold the lock of the session in `folder` within the context. Raises StudyError, without waiting, where it is held
    already or the folder is not writable."""
    held_error = StudyError(
        "This session is running elsewhere",
        f"Another program is writing to {folder.name}.",
        "Close it there first.",
        saved="Nothing was changed.",
    )
    return hold_file_lock(folder / SESSION_LOCK_NAME, held_error, "The session's folder")


def hold_places_lock(data_folder: Path) -> AbstractContextManager[None]:
    """Hold the lock of the data folder within the context, for the assignment of a participant number. Waits while
    another program holds it. Raises StudyError after `PLACES_LOCK_TIMEOUT_S`, and where the data folder is not
    writable."""
    held_error = StudyError(
        "No place in the order of conditions could be taken",
        f"Another program has held {PLACES_LOCK_NAME} in {data_folder} for {PLACES_LOCK_TIMEOUT_S:g} s.",
        "End the program that holds it.",
        saved="The forms are on disk; no trial was played.",
    )
    return hold_file_lock(data_folder / PLACES_LOCK_NAME, held_error, "The data folder", PLACES_LOCK_TIMEOUT_S)
