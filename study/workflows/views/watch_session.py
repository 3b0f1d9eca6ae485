"""Follow a running session from a second process.

The log is only read: new lines are checked against the hash chain and applied to the state one by one.
"""

import io
from pathlib import Path
from typing import TYPE_CHECKING

from study.errors import StudyError
from study.regular_file import MAX_TABLE_BYTES, open_regular
from study.session.facts.events import SessionOpened, parse_event
from study.session.facts.log_chain import Chain, ChainBrokenError, verify_checksum
from study.session.facts.log_time import compute_wall_clock_s
from study.session.state.presentation_check import LogContradictionError
from study.session.views.printable import make_printable
from study.session.watching.followed_session import FollowedSession, apply_followed_event, begin_watching
from study.session.watching.live_state import LiveState
from study.session.watching.make_watch_view import LiveInfo, make_watch_view
from study.session.watching.watch_alarms import LIVE_TIMEOUT_S
from study.session.watching.watch_view import DriftRecord, WatchView
from study.store.sessions.archive import SessionFolder
from study.store.sessions.live_file import read_live
from study.store.sessions.log_lock import is_log_locked
from study.store.sessions.log_seal import find_seals, read_seal
from study.workflows.results.fold_session import load_logged_protocol

if TYPE_CHECKING:
    from study.workflows.results.session_drift import DriftReader

LOCK_CHECK_INTERVAL_S = 1.0
"""Shortest interval (s) between checks of the log's lock, for a session whose live state is out of date. Chosen."""
_INVALID_FIRST_LINE = "The first line of the log of {} is none that this version knows."
"""Message for a log with an invalid first line; the placeholder is the session's name."""


def follow(folder: Path) -> "Follower":
    """Make a follower of the session in this folder; nothing is read yet."""
    return Follower(SessionFolder(folder))


class Follower:
    """Follower of one session: `look` reads the new part of its log and returns the view. Never writes."""

    def __init__(self, folder: SessionFolder) -> None:
        self._folder = folder
        self._watched: FollowedSession | None = None
        self._read_byte_count = 0
        self._last_line = b""
        self._chain = Chain()
        self._problem = ""
        self._log_missing = False
        self._view: WatchView | None = None
        self._log_has_writer: bool | None = None
        self._lock_checked_utc = ""
        self._drifts: DriftReader | None = None

    def look(self, now_utc: str) -> WatchView | None:
        """Read the new lines and make the view at the time now_utc (ISO 8601), with control characters of notes and
        names replaced; None while there is no log, or no complete line in it. Raises StudyError where the log cannot be
        read, or its first line is invalid, before a line has been applied. Later damage is reported in the view."""
        self._read_new_lines()
        if self._watched is None:
            return None
        live = read_live(self._folder.path)
        live_info = LiveInfo(live, self._has_writer(live, now_utc), self._problem, self._update_drifts(self._watched))
        self._view = make_printable(make_watch_view(self._watched, live_info, now_utc, self._view))
        return self._view

    def _update_drifts(self, watched: FollowedSession) -> tuple[DriftRecord, ...]:
        """Update the drifts of device and hand from the probes so far; empty without probes."""
        if not watched.probes:
            return ()
        if self._drifts is None:  # imported here, because the import is slow and most sessions have no probes
            from study.workflows.results.session_drift import DriftReader

            self._drifts = DriftReader(self._folder)
        return self._drifts.update(watched.probes)

    def _read_new_lines(self) -> None:
        """Read the new part of the log and apply its complete lines. Reading stops at an invalid line, which is read
        again at the next look. Raises StudyError as `look`."""
        # Read before the log: a seal is written after the lines that it covers, so the log must be as long.
        sealed_bytes = self._count_sealed_bytes()
        try:
            with open_regular(self._folder.log) as file:
                self._restart_if_rewritten(file)
                file.seek(self._read_byte_count)
                new_bytes = file.read(MAX_TABLE_BYTES)
        except OSError as problem:
            self._problem, self._log_missing = f"{problem.strerror or problem}.", isinstance(problem, FileNotFoundError)
            if self._watched is None and not self._log_missing:
                raise _make_unfollowable_error(f"The log of {self._folder.name}: {self._problem}") from problem
            return
        self._problem, self._log_missing = "", False
        # Bytes after the last line end belong to a line that is being written, or that a crash left incomplete.
        for line in (complete_line + b"\n" for complete_line in new_bytes.split(b"\n")[:-1]):
            self._problem = self._apply_line(line)
            if self._problem:
                return
            self._read_byte_count += len(line)
            self._last_line = line
        if sealed_bytes is None:
            self._problem = "its seal cannot be read."
        elif sealed_bytes > self._read_byte_count:
            self._problem = "its end is missing."

    def _count_sealed_bytes(self) -> int | None:
        """Count the bytes of the log that its seals cover; 0 without a seal, None if a seal cannot be read."""
        try:
            return max((read_seal(path).bytes for path in find_seals(self._folder.path).values()), default=0)
        except StudyError:
            return None

    def _restart_if_rewritten(self, file: io.BufferedReader) -> None:
        """Start again from the first line if the last line read is no longer at its place in the file: the writer of a
        log removes a line that could not be synced to the disk."""
        file.seek(self._read_byte_count - len(self._last_line))
        if file.read(len(self._last_line)) != self._last_line:
            self._watched, self._read_byte_count, self._last_line, self._chain = None, 0, b"", Chain()

    def _apply_line(self, line: bytes) -> str:
        """Apply one line of the log; returns its problem as a clause, empty if there is none. Raises StudyError for an
        invalid first line."""
        try:
            chain, content = verify_checksum(self._chain, line.removesuffix(b"\n"))
            event = parse_event(content)
        except ValueError as problem:
            if self._watched is None:
                raise _make_unfollowable_error(_INVALID_FIRST_LINE.format(self._folder.name)) from None
            if isinstance(problem, ChainBrokenError):
                return f"line {self._chain.lines + 1} of it {problem}."
            return "a line of it is no event that this version knows."
        if self._watched is None:
            if not isinstance(event, SessionOpened):
                raise _make_unfollowable_error(_INVALID_FIRST_LINE.format(self._folder.name))
            try:
                self._watched = begin_watching(event, load_logged_protocol(event, self._folder))
            except LogContradictionError:
                raise _make_unfollowable_error(_INVALID_FIRST_LINE.format(self._folder.name)) from None
            self._chain = chain
            return ""
        try:
            self._watched = apply_followed_event(self._watched, event)
        except LogContradictionError:
            # The text of the exception is not shown: it may reveal the stimulus of the open trial.
            return "it contradicts the rules."
        self._chain = chain
        return ""

    def _has_writer(self, live: LiveState | None, now_utc: str) -> bool | None:
        """Whether a program has the log open for writing; None while a recent live state makes the check
        unnecessary."""
        if self._log_missing:
            return False
        if live is not None and compute_wall_clock_s(live.utc, now_utc) <= LIVE_TIMEOUT_S:
            self._log_has_writer = None
        elif (
            abs(compute_wall_clock_s(self._lock_checked_utc, now_utc)) >= LOCK_CHECK_INTERVAL_S
            or not self._lock_checked_utc
        ):
            self._lock_checked_utc = now_utc
            self._log_has_writer = is_log_locked(self._folder.log)
        return self._log_has_writer


def _make_unfollowable_error(problem: str) -> StudyError:
    """Make the error for a session that this version cannot follow. problem: cause, as a sentence."""
    return StudyError(
        "This session cannot be followed",
        problem,
        "Use the hapteq that runs the session; hapteq validate says more.",
    )
