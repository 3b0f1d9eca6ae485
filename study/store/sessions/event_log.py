"""The log of a session: an append-only file with one JSON event per line, each with a checksum (`log_chain`).

A program appends the line and syncs it to the disk (fsync) before it acts on the event (write-ahead), so that no action
follows from an event that the log lacks. Lines are never rewritten; only an incomplete last line, which a crash or a
failed write leaves, is removed. `EventLog` writes a log, `read_log` reads it.
"""

import contextlib
import json
import os
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

from study.errors import StudyError
from study.regular_file import MAX_DOCUMENT_BYTES, open_regular, read_regular
from study.session.facts.events import SESSION_FORMAT, SESSION_VERSION, Event, encode_event, parse_event
from study.session.facts.log_chain import Chain, ChainBrokenError, append_checksum, verify_checksum
from study.store.disk.atomic_write import sync_folder
from study.store.disk.privacy import PRIVATE_FILE

LOG_NAME = "events.jsonl"
"""Name of the log in the session's folder."""
EMPTY_CHAIN = Chain()
"""The hash chain before the first line."""


class EventLog:
    """A log that is open for appending. It has a single writer, which holds the session's lock."""

    def __init__(self, path: Path, descriptor: int, chain: Chain | None = EMPTY_CHAIN) -> None:
        """descriptor: descriptor of the file, open for appending. chain: hash chain of the existing lines; None: it is
        read before the first line is added."""
        self._path = path
        self._descriptor = descriptor
        self._chain = chain
        self._incomplete_from: int | None = None
        """Position (bytes) of an incomplete last line that could not be removed; None where there is none."""

    @classmethod
    def create(cls, path: Path) -> "EventLog":
        """Create an empty log. Raises StudyError where it exists or cannot be created, or another program has locked
        it."""
        descriptor = -1
        try:
            descriptor = os.open(path, os.O_WRONLY | os.O_APPEND | os.O_CREAT | os.O_EXCL, PRIVATE_FILE)
            sync_folder(path.parent)
        except OSError as problem:
            if descriptor >= 0:
                os.close(descriptor)
            raise StudyError(
                "The session log cannot be made",
                f"{path.name} in {path.parent.name}: {problem.strerror}.",
                "Make room on the disk and check the permissions of the session's folder, then begin again.",
            ) from problem
        _lock_file(descriptor, path)
        return cls(path, descriptor)

    @classmethod
    def reopen(cls, path: Path) -> "EventLog":
        """Open an existing log for appending. Raises StudyError if it cannot be written to or another program has it
        open."""
        try:
            open_regular(path).close()  # Refuses a named pipe, which would block until its other end is opened.
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
        """Append one line; on return it is on the disk. Raises StudyError where it cannot be written, the log was moved
        or deleted, or the existing lines are unusable; the log is then unchanged, unless an incomplete line cannot be
        removed either: that is done before the next line is written."""
        _require_in_place(self._path, self._descriptor)
        incomplete_from = self._incomplete_from
        previous_size = os.fstat(self._descriptor).st_size if incomplete_from is None else incomplete_from
        if self._chain is None:
            self._chain = read_log(self._path).chain
        extended_chain, line = append_checksum(self._chain, encode_event(event).removesuffix(b"\n"))
        try:
            if incomplete_from is not None:
                os.ftruncate(self._descriptor, incomplete_from)
            _write_all(self._descriptor, line)
            os.fsync(self._descriptor)
        except BaseException as problem:
            # Also on Ctrl-C: an incomplete line would corrupt the next line.
            self._incomplete_from = previous_size
            with contextlib.suppress(OSError):
                os.ftruncate(self._descriptor, previous_size)
                self._incomplete_from = None
            if isinstance(problem, OSError):
                raise _make_save_error(self._path, event, problem) from problem
            raise
        self._chain, self._incomplete_from = extended_chain, None

    def close(self) -> None:
        """Close the file; all lines are on the disk already. To be called once only."""
        os.close(self._descriptor)


@dataclass(frozen=True, slots=True)
class LogContents:
    """Content of a session's log: its events, and separately an incomplete last line."""

    events: tuple[Event, ...]
    torn: str
    """Text of an incomplete last line (torn write), left by a crash; empty if there is none."""
    torn_bytes: int
    """Length of the incomplete line in bytes."""
    chain: Chain
    """Hash chain after the last complete line."""
    complete_lines: bytes = field(repr=False)
    """All complete lines, as on the disk."""


def read_log(path: Path) -> LogContents:
    """Read a log. Only the last line may be incomplete. Raises StudyError where the file cannot be read, or a complete
    line is damaged or unknown."""
    try:
        log_bytes = read_regular(path)
    except OSError as problem:
        raise StudyError(
            "The session log cannot be read",
            f"{path.name} in {path.parent.name}: {problem.strerror}.",
            "Check the folder's name and permissions.",
        ) from problem
    *whole_lines, incomplete_line = log_bytes.split(b"\n")
    chain, events = Chain(), []
    for line in whole_lines:
        chain, event = _parse_next_line(path, chain, line)
        events.append(event)
    complete_lines = log_bytes[: len(log_bytes) - len(incomplete_line)]
    return LogContents(
        tuple(events), incomplete_line.decode("utf-8", errors="replace"), len(incomplete_line), chain, complete_lines
    )


def read_opening(path: Path) -> Event | None:
    """Read the event of the first line alone; None if the file or a complete line is missing. Raises StudyError for a
    damaged or unknown line, OSError where the file cannot be read."""
    if not path.exists():
        return None
    with open_regular(path) as file:
        line = file.readline(MAX_DOCUMENT_BYTES)
    return _parse_next_line(path, Chain(), line.removesuffix(b"\n"))[1] if line.endswith(b"\n") else None


def read_valid_events(path: Path) -> tuple[Event, ...]:
    """Read the events before the first damaged or unknown line, to inspect an unusable log; empty where the file cannot
    be read."""
    chain, events = Chain(), list[Event]()
    try:
        for line in read_regular(path).split(b"\n")[:-1]:
            chain, event = verify_checksum(chain, line)
            events.append(parse_event(event))
    except (OSError, ValueError):
        pass  # The damage begins here; the caller reports it.
    return tuple(events)


def remove_incomplete_line(path: Path, contents: LogContents) -> None:
    """Remove an incomplete last line, so that the next event starts on a new line. Raises StudyError where the file
    cannot be changed."""
    if not contents.torn_bytes:
        return
    try:
        descriptor = os.open(path, os.O_WRONLY)
        try:
            os.ftruncate(descriptor, os.fstat(descriptor).st_size - contents.torn_bytes)
            os.fsync(descriptor)
        finally:
            os.close(descriptor)
    except OSError as problem:
        raise StudyError(
            "The session log cannot be written to",
            f"The incomplete last line of {path.name} in {path.parent.name} cannot be removed: {problem.strerror}.",
            "Make room or mend the disk.",
            saved="All complete lines are on disk.",
        ) from problem


def _lock_file(descriptor: int, path: Path) -> None:
    """Lock the log itself, in addition to the lock file, which might be deleted while its holder still writes. Raises
    StudyError if another program holds the lock; does nothing where the system has no such locks."""
    try:
        import fcntl
    except ImportError:  # Windows has no flock: the lock file alone protects the log.
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
        return  # A network file system without such locks: the lock file has to suffice.


@contextlib.contextmanager
def hold_log_lock(path: Path) -> Iterator[None]:
    """Hold the lock of a log that is to be erased; without a log, do nothing. Raises StudyError while a program writes
    it, and where it cannot be opened."""
    if not path.exists():
        yield
        return
    log = EventLog.reopen(path)
    try:
        yield
    finally:
        log.close()


def _parse_next_line(path: Path, chain: Chain, line: bytes) -> tuple[Chain, Event]:
    """Verify and parse the next line; returns the chain after it, and its event. chain: hash chain of the lines before.
    line: without its line end. Raises StudyError for a line that is damaged, unknown, or of a newer version."""
    try:
        extended_chain, event = verify_checksum(chain, line)
        return extended_chain, parse_event(event)
    except ValueError as problem:
        line_number = chain.lines + 1
        if line_number == 1 and _has_newer_version(line):
            raise StudyError(
                "This session was written by a newer hapteq",
                f"The log of {path.parent.name} is of a version that this program does not know.",
                "Use the hapteq that began it, or a newer one.",
                saved="Nothing was changed.",
            ) from problem
        title, remedy = (
            "The session log is damaged",
            "Keep the folder as it is and restore the file from a copy; nothing was changed.",
        )
        clause, saved_text = (
            "is not an event that this version knows",
            f"The {line_number - 1} lines before it are whole.",
        )
        if isinstance(problem, ChainBrokenError):
            clause = f"{problem}"
            if (
                line_number > 1 and not chain.first_checksum_line
            ):  # This checksum covers earlier lines without a checksum, too.
                clause, saved_text = f"{problem}, or one of the lines before it was changed", "Nothing was changed."
        elif verify_checksum(chain, line)[1] != line:  # it has a checksum, which is right
            title = "The session log holds an unknown event"
            remedy = "It is not damaged: use the newer hapteq that wrote it. If it was edited, restore it from a copy."
        happened = f"Line {line_number} of {path.name} in {path.parent.name} {clause}."
        raise StudyError(title, happened, remedy, saved=saved_text) from problem


def _has_newer_version(line: bytes) -> bool:
    """Whether a first line opens a session in a later version of the format than `SESSION_VERSION`."""
    try:
        first_event = json.loads(line)
    except (ValueError, RecursionError):
        return False
    if not isinstance(first_event, dict) or first_event.get("format") != SESSION_FORMAT:
        return False
    version = first_event.get("version")
    return isinstance(version, int) and version > SESSION_VERSION


def _require_in_place(path: Path, descriptor: int) -> None:
    """Raise StudyError unless the open log is still the file at its path: a line would be written into a deleted file,
    or into a folder that is not the session's any more. Not on Windows, which moves no folder of an open file."""
    try:
        is_in_place = os.name == "nt" or os.path.samestat(path.stat(), os.fstat(descriptor))
    except OSError:
        is_in_place = False
    if not is_in_place:
        raise StudyError(
            "The session log is gone",
            f"While the session ran, {path.name} was moved, deleted or replaced, or its disk is out of reach: {path}.",
            "Connect the disk again, or put the folder back in its place, from where it was moved to or from a copy.",
            saved="Everything logged before is in that file, wherever it is now; lost if it was deleted.",
        )


def _write_all(descriptor: int, unwritten_bytes: bytes) -> None:
    """Write all bytes: `os.write` may write fewer than it was given."""
    while unwritten_bytes:
        unwritten_bytes = unwritten_bytes[os.write(descriptor, unwritten_bytes) :]


def _make_save_error(path: Path, event: Event, problem: OSError) -> StudyError:
    """Make the error for an event that could not be written."""
    return StudyError(
        "The session cannot be written to disk",
        f"Writing '{event.event.replace('_', ' ')}' to {path.name} of {path.parent.name} failed: {problem.strerror}.",
        "Make room or mend the disk.",
        saved="Everything logged before is on disk.",
    )
