"""The log of a session: append one line, fsync, and only then act. Never rewritten."""

import contextlib
import json
import os
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

from study.errors import StudyError
from study.regular_file import DOCUMENT_BYTES, open_regular, read_regular
from study.session.facts.events import SESSION_FORMAT, SESSION_VERSION, Event, event_line, parse_event
from study.session.facts.log_chain import Chain, ChainBrokenError, read_chained, write_chained
from study.store.disk.atomic_write import sync_folder
from study.store.disk.privacy import PRIVATE_FILE

LOG_NAME = "events.jsonl"
NO_LINES = Chain()
"""The hash chain before the first line."""


class EventLog:
    """An open log. One writer: hold the session's lock while it is open."""

    def __init__(self, path: Path, descriptor: int, chain: Chain | None = NO_LINES) -> None:
        """chain: of the existing lines; None reads them before the first line is added."""
        self._path = path
        self._descriptor = descriptor
        self._chain = chain

    @classmethod
    def create(cls, path: Path) -> "EventLog":
        """Raises FileExistsError rather than touch an existing log."""
        descriptor = os.open(path, os.O_WRONLY | os.O_APPEND | os.O_CREAT | os.O_EXCL, PRIVATE_FILE)
        sync_folder(path.parent)
        _lock_file(descriptor, path)
        return cls(path, descriptor)

    @classmethod
    def reopen(cls, path: Path) -> "EventLog":
        """Open an existing log for appending. Raises StudyError if it cannot be written to."""
        try:
            open_regular(path).close()  # a named pipe would block until its other end is opened
            descriptor = os.open(path, os.O_WRONLY | os.O_APPEND)
        except OSError as problem:
            raise StudyError(
                "The session log cannot be written to",
                f"{path.name} in {path.parent.name}: {problem.strerror}.",
                "Check the permissions of the session's folder.",
                saved="Nothing was changed.",
            ) from problem
        _lock_file(descriptor, path)
        return cls(path, descriptor, chain=None)

    def append(self, event: Event) -> None:
        """Append one line; on return it is on the disk. Raises StudyError, leaving the log unchanged, if that fails."""
        before = os.fstat(self._descriptor).st_size
        if self._chain is None:
            self._chain = read_log(self._path).chain
        after, line = write_chained(self._chain, event_line(event).removesuffix(b"\n"))
        try:
            _write_all(self._descriptor, line)
            os.fsync(self._descriptor)
        except BaseException as problem:
            # Also on Ctrl-C: half a line would corrupt the next one.
            with contextlib.suppress(OSError):
                os.ftruncate(self._descriptor, before)
            if isinstance(problem, OSError):
                raise _not_saved(self._path, event, problem) from problem
            raise
        self._chain = after

    def close(self) -> None:
        """Close the file; its lines are on the disk already. Called once."""
        os.close(self._descriptor)


@dataclass(frozen=True, slots=True)
class LogContents:
    """Content of a session's log: its events, and an incomplete last line apart from them."""

    events: tuple[Event, ...]
    torn: str
    """An incomplete last line, left by a crash; empty if there is none."""
    torn_bytes: int
    chain: Chain
    whole: bytes = field(repr=False)
    """All complete lines, as on the disk."""


def read_log(path: Path) -> LogContents:
    """All complete events. Only the last line may be incomplete; a broken earlier line is an error. Raises
    StudyError."""
    try:
        data = read_regular(path)
    except OSError as problem:
        raise StudyError(
            "The session log cannot be read",
            f"{path.name} in {path.parent.name}: {problem.strerror}.",
            "Check the folder's name and permissions.",
        ) from problem
    *lines, tail = data.split(b"\n")
    chain, events = Chain(), []
    for line in lines:
        chain, event = _parse_next(path, chain, line)
        events.append(event)
    whole = data[: len(data) - len(tail)]
    return LogContents(tuple(events), tail.decode("utf-8", errors="replace"), len(tail), chain, whole)


def read_opening(path: Path) -> Event | None:
    """The first line only; None if it is incomplete. Raises StudyError, OSError."""
    if not path.exists():
        return None
    with open_regular(path) as file:
        line = file.readline(DOCUMENT_BYTES)
    return _parse_next(path, Chain(), line.removesuffix(b"\n"))[1] if line.endswith(b"\n") else None


def readable_events(path: Path) -> tuple[Event, ...]:
    """Events before the first damage, to inspect an unusable log. Never raises."""
    chain, events = Chain(), list[Event]()
    try:
        for line in read_regular(path).split(b"\n")[:-1]:
            chain, event = read_chained(chain, line)
            events.append(parse_event(event))
    except (OSError, ValueError):
        pass  # the damage begins here; the caller reports it
    return tuple(events)


def mend(path: Path, contents: LogContents) -> None:
    """Remove an incomplete last line, so that the next fact starts on its own line."""
    if not contents.torn_bytes:
        return
    descriptor = os.open(path, os.O_WRONLY)
    try:
        os.ftruncate(descriptor, os.fstat(descriptor).st_size - contents.torn_bytes)
        os.fsync(descriptor)
    finally:
        os.close(descriptor)


def _lock_file(descriptor: int, path: Path) -> None:
    """A second lock, on the log itself: the lock file might be deleted while its holder still writes."""
    try:
        import fcntl
    except ImportError:  # Windows; the lock file is all there is
        return
    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError as problem:
        os.close(descriptor)
        raise StudyError(
            "This session is running elsewhere",
            f"Another program is writing to {path.parent.name}.",
            "Close it there first.",
            saved="Nothing was changed.",
        ) from problem
    except OSError:
        return  # a network file system without such locks: the lock file has to suffice


@contextlib.contextmanager
def hold_log_lock(path: Path) -> Iterator[None]:
    """Hold the lock of a log that is to be erased. Raises StudyError while it is being written."""
    if not path.exists():
        yield
        return
    log = EventLog.reopen(path)
    try:
        yield
    finally:
        log.close()


def _parse_next(path: Path, chain: Chain, line: bytes) -> tuple[Chain, Event]:
    """The event of the next line, given without its line end. Raises StudyError."""
    try:
        after, event = read_chained(chain, line)
        return after, parse_event(event)
    except ValueError as problem:
        number = chain.lines + 1
        if number == 1 and _is_newer(line):
            raise StudyError(
                "This session was written by a newer hapteq",
                f"The log of {path.parent.name} is of a version that this program does not know.",
                "Use the hapteq that began it, or a newer one.",
                saved="Nothing was changed.",
            ) from problem
        wrong, whole = "is not an event that this version knows", f"The {number - 1} lines before it are whole."
        if isinstance(problem, ChainBrokenError):
            wrong = f"{problem}"
            if number > 1 and not chain.since:  # earlier lines without checksum are covered by this one
                wrong, whole = f"{problem}, or one of the lines before it was changed", "Nothing was changed."
        raise StudyError(
            "The session log is damaged",
            f"Line {number} of {path.name} in {path.parent.name} {wrong}.",
            "Keep the folder as it is and restore the file from a copy; nothing was changed.",
            saved=whole,
        ) from problem


def _is_newer(line: bytes) -> bool:
    try:
        opening = json.loads(line)
    except (ValueError, RecursionError):
        return False
    known = isinstance(opening, dict) and opening.get("format") == SESSION_FORMAT
    return known and opening.get("version") != SESSION_VERSION


def _write_all(descriptor: int, data: bytes) -> None:
    while data:
        data = data[os.write(descriptor, data) :]


def _not_saved(path: Path, event: Event, problem: OSError) -> StudyError:
    return StudyError(
        "The session cannot be written to disk",
        f"Writing '{event.event.replace('_', ' ')}' to {path.name} of {path.parent.name} failed: {problem.strerror}.",
        "Make room or mend the disk.",
        saved="Everything logged before is on disk.",
    )
