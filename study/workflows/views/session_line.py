"""Summary line of a session for lists of sessions. Only reads files.

A list must be fast: the log of a finished session whose checksums and seal are valid is trusted, and its events are
counted without parsing them. Other logs are folded: their events are applied one by one to the session's state.
"""

from dataclasses import replace
from datetime import UTC, datetime
from functools import lru_cache

from protocols.definition.study_protocol import StudyProtocol
from protocols.document.loading import ProtocolError, load_protocol
from protocols.procedure.schedule import schedule_runs
from study.errors import StudyError
from study.regular_file import read_regular
from study.session.facts.events import SessionOpened
from study.session.state.state import SessionState
from study.session.views.archive_views import SessionLine
from study.store.sessions.archive import SessionFolder
from study.store.sessions.event_log import read_opening
from study.store.sessions.log_lock import is_log_locked
from study.store.sessions.log_seal import find_seals, is_sealed
from study.store.sessions.session_summary import SUMMARY_NAME
from study.store.sessions.withdrawal_files import describe_unfinished_withdrawal, read_intent, read_tombstone
from study.workflows.results.fold_session import fold_session

MEASURED_EVENT = b',"event":"trial_measured",'
"""Bytes in the line of a log that closes a counted trial; they are counted without parsing. Only the writer
of the log produces them: a quotation mark inside a text is escaped."""


def make_session_line(folder: SessionFolder) -> SessionLine:
    """Make the line of a session. Where its files cannot be read, the line has a remark; no StudyError or OSError is
    raised."""
    try:
        if folder.withdrawn:
            return _make_withdrawn_line(folder)
        line = _make_cached_line(folder, _read_file_stamps(folder))
    except FileNotFoundError:
        return make_unreadable_line(folder, "It has no log: the program died while it was made.")
    except StudyError as problem:
        return make_unreadable_line(folder, problem.happened)
    except OSError as problem:
        return make_unreadable_line(folder, f"The system refused: {problem.strerror or problem}.")
    return mark_running(line, folder)


def mark_running(line: SessionLine, folder: SessionFolder) -> SessionLine:
    """Mark the line of an unfinished session as `running` if a process has its log open for writing."""
    if line.standing == "unfinished" and is_log_locked(folder.log):
        return replace(line, standing="running")
    return line


def make_line_from_state(state: SessionState, folder: SessionFolder) -> SessionLine:
    """Make the line of a session from the state of its folded log; never `running`, see `mark_running`."""
    session_opened = state.opened
    return SessionLine(
        name=folder.name,
        path=str(folder.path),
        subject=folder.subject,
        protocol=state.protocol.name,
        begun_utc=session_opened.utc,
        observer=session_opened.observer,
        answers=state.answers,
        runs_done=state.run,
        runs=len(state.runs),
        standing=state.sitting.ineligibility or ("finished" if state.closed else "unfinished"),
        device=session_opened.device.name,
    )


def make_unreadable_line(folder: SessionFolder, remark: str) -> SessionLine:
    """Make the line of an unreadable session. Its start is unknown; the last change of its folder takes its place,
    empty if that is not known. remark: cause, as a sentence."""
    try:
        changed_utc = datetime.fromtimestamp(folder.path.stat().st_mtime, UTC).isoformat(timespec="seconds")
    except OSError:
        changed_utc = ""
    return SessionLine(
        folder.name, str(folder.path), folder.subject, "", changed_utc, None, 0, 0, 0, "unreadable", remark
    )


def _make_withdrawn_line(folder: SessionFolder) -> SessionLine:
    """Make the line of a withdrawn session, from its tombstone (a file that remains after the erasure) or, before that
    is written, from the record of the intended withdrawal. The time of the withdrawal takes the place of the start."""
    tombstone = read_tombstone(folder)
    intent = read_intent(folder.path.parent, folder.subject)
    withdrawn_utc = str(tombstone.get("withdrawn_utc", intent.withdrawn_utc if intent else ""))
    begun_facts = tombstone.get("begun")
    if begun_facts is None and intent is not None and (intended_session := intent.sessions.get(folder.name)):
        begun_facts = {"protocol": intended_session.protocol}
    protocol = str(begun_facts.get("protocol", "")) if isinstance(begun_facts, dict) else ""
    remark_text = "The participant withdrew; the data were erased."
    if unfinished_text := describe_unfinished_withdrawal(folder):
        remark_text = f"The participant withdrew, and not everything is erased. {unfinished_text}"
    return SessionLine(
        folder.name, str(folder.path), folder.subject, protocol, withdrawn_utc, None, 0, 0, 0, "withdrawn", remark_text
    )


def _read_file_stamps(folder: SessionFolder) -> tuple[tuple[str, int, int, int], ...]:
    """Read name, time of modification and of status change (ns) and size (bytes) of all files that determine the line:
    log, seals and summary. Raises OSError if there is no log."""
    result_files = (path for path in (*find_seals(folder.path).values(), folder.path / SUMMARY_NAME) if path.exists())
    statuses = ((path.name, path.stat()) for path in (folder.log, *result_files))
    return tuple((name, status.st_mtime_ns, status.st_ctime_ns, status.st_size) for name, status in statuses)


@lru_cache(maxsize=4096)  # more sessions than a data folder usually has
def _make_cached_line(folder: SessionFolder, file_stamps: tuple[tuple[str, int, int, int], ...]) -> SessionLine:
    """Make the line of a session that is not withdrawn. file_stamps: key of the cache (`_read_file_stamps`); the result
    depends only on these files. Raises StudyError where the log is invalid, OSError where it cannot be read."""
    content = read_regular(folder.log)
    session_opened = read_opening(folder.log)
    is_trusted = (
        isinstance(session_opened, SessionOpened)
        and session_opened.session == folder.name
        and is_sealed(folder.path, content)
        and MEASURED_EVENT in content  # not so where the participant was excluded before any trial
    )
    name_and_run_count = (
        _read_name_and_run_count(session_opened.protocol_text)
        if is_trusted and isinstance(session_opened, SessionOpened)
        else None
    )
    if name_and_run_count is None or not isinstance(session_opened, SessionOpened):
        return make_line_from_state(fold_session(folder).state, folder)
    protocol, run_count = name_and_run_count
    return SessionLine(
        name=folder.name,
        path=str(folder.path),
        subject=folder.subject,
        protocol=protocol,
        begun_utc=session_opened.utc,
        observer=session_opened.observer,
        answers=content.count(MEASURED_EVENT),
        runs_done=run_count,
        runs=run_count,
        standing="finished",
        device=session_opened.device.name,
    )


@lru_cache(maxsize=64)  # more protocols than a data folder usually has
def _read_name_and_run_count(protocol_text: str) -> tuple[str, int] | None:
    """Read name and number of runs of a study protocol; None for text that is not one."""
    try:
        protocol = load_protocol(protocol_text, "the log")
    except ProtocolError:
        return None
    # Seed and participant number (0, 0) determine the order of the runs, not their number.
    return (protocol.name, len(schedule_runs(protocol, 0, 0))) if isinstance(protocol, StudyProtocol) else None
