"""The log of a session: append one line, fsync, and only then act. Never rewritten, never opened over another."""

import contextlib
import os
from dataclasses import dataclass
from pathlib import Path

from study.errors import StudyError
from study.session.events import Event, event_line, parse_event
from study.store.atomic_write import sync_folder

LOG_NAME = "events.jsonl"


class EventLog:
    """An open log. One writer at a time: hold the session's lock while one of these is open."""

    def __init__(self, path: Path, descriptor: int) -> None:
        self._path = path
        self._descriptor = descriptor

    @classmethod
    def create(cls, path: Path) -> "EventLog":
        """Raises FileExistsError rather than touch an existing log."""
        descriptor = os.open(path, os.O_WRONLY | os.O_APPEND | os.O_CREAT | os.O_EXCL, 0o644)
        sync_folder(path.parent)
        return cls(path, descriptor)

    @classmethod
    def reopen(cls, path: Path) -> "EventLog":
        return cls(path, os.open(path, os.O_WRONLY | os.O_APPEND))

    def append(self, event: Event) -> None:
        """On return the line is on the disk. Raises StudyError, leaving the log as it was, where it is not."""
        before = os.fstat(self._descriptor).st_size
        try:
            _write_all(self._descriptor, event_line(event))
            os.fsync(self._descriptor)
        except OSError as problem:
            with contextlib.suppress(OSError):
                os.ftruncate(self._descriptor, before)
            raise _not_saved(self._path, event, problem) from problem

    def close(self) -> None:
        os.close(self._descriptor)


@dataclass(frozen=True, slots=True)
class LogContents:
    events: tuple[Event, ...]
    torn: str
    """A last line that a crash left incomplete; empty where there is none."""
    torn_bytes: int


def read_log(path: Path) -> LogContents:
    """All whole events. Only the last line may be torn; a broken line before it is an error, not a loss."""
    try:
        data = path.read_bytes()
    except OSError as problem:
        raise StudyError(
            "The session log cannot be read",
            f"{path.name} in {path.parent.name}: {problem.strerror}.",
            "Check the folder's name and permissions.",
        ) from problem
    *lines, tail = data.split(b"\n")
    events = tuple(_event(path, number, line) for number, line in enumerate(lines, start=1))
    return LogContents(events, torn=tail.decode("utf-8", errors="replace"), torn_bytes=len(tail))


def mend(path: Path, contents: LogContents) -> None:
    """Cut off a torn last line, so that the next fact starts on a line of its own."""
    if not contents.torn_bytes:
        return
    descriptor = os.open(path, os.O_WRONLY)
    try:
        os.ftruncate(descriptor, os.fstat(descriptor).st_size - contents.torn_bytes)
        os.fsync(descriptor)
    finally:
        os.close(descriptor)


def _event(path: Path, number: int, line: bytes) -> Event:
    try:
        return parse_event(line)
    except ValueError as problem:
        raise StudyError(
            "The session log is damaged",
            f"Line {number} of {path.name} in {path.parent.name} is not an event that this version knows.",
            "Keep the folder as it is and restore the file from a copy; nothing was changed.",
            saved=f"The {number - 1} lines before it are whole.",
        ) from problem


def _write_all(descriptor: int, data: bytes) -> None:
    while data:
        data = data[os.write(descriptor, data) :]


def _not_saved(path: Path, event: Event, problem: OSError) -> StudyError:
    return StudyError(
        "The session cannot be written to disk",
        f"Writing '{event.event.replace('_', ' ')}' to {path.name} failed: {problem.strerror}. The force was released.",
        f"Make room or mend the disk, then run: hapteq resume {path.parent.name}",
        saved="Every answer before this one is on disk; the open trial will be drawn again.",
    )
