"""One line per session in a list (`view_home`, `plan_study`). Only reads files.

A list must be fast: the log of a finished session whose checksums and seal are valid is trusted, and its events are
counted without parsing them. Every other log is folded.
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
from study.store.sessions.withdrawal_files import describe_unfinished, read_intent, read_tombstone
from study.workflows.results.fold_session import fold_session

MEASURED_EVENT = b',"event":"trial_measured",'
"""Bytes in the line of a log that closes a counted trial; they are counted without parsing."""


def make_session_line(folder: SessionFolder) -> SessionLine:
    """The line of a session; an unreadable session has a remark. Raises no StudyError and no OSError."""
    try:
        if folder.withdrawn:
            return _make_withdrawn_line(folder)
        line = _make_cached_line(folder, _stamp_files(folder))
    except FileNotFoundError:
        return make_unreadable_line(folder, "It has no log: the program died while it was made.")
    except StudyError as problem:
        return make_unreadable_line(folder, problem.happened)
    except OSError as problem:
        return make_unreadable_line(folder, f"The system refused: {problem.strerror or problem}.")
    return mark_running(line, folder)


def mark_running(line: SessionLine, folder: SessionFolder) -> SessionLine:
    """The line, marked `running` if a process is writing the session now. To find out, its lock is taken for some
    microseconds."""
    if line.standing == "unfinished" and is_log_locked(folder.log):
        return replace(line, standing="running")
    return line


def make_line_from_state(state: SessionState, folder: SessionFolder) -> SessionLine:
    """The line of a session whose log was folded; never `running`, see `mark_running`."""
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
    )


def make_unreadable_line(folder: SessionFolder, remark: str) -> SessionLine:
    """Line of an unreadable session. Its start is unknown, so that it is sorted by the last change of its folder."""
    try:
        changed_utc = datetime.fromtimestamp(folder.path.stat().st_mtime, UTC).isoformat(timespec="seconds")
    except OSError:
        changed_utc = ""
    return SessionLine(
        folder.name, str(folder.path), folder.subject, "", changed_utc, None, 0, 0, 0, "unreadable", remark
    )


def _make_withdrawn_line(folder: SessionFolder) -> SessionLine:
    """Line of a withdrawn session, from its tombstone or, before that is written, from the record of the withdrawal."""
    tombstone = read_tombstone(folder)  # its existence is information enough
    intent = read_intent(folder.path.parent, folder.subject)
    withdrawn_utc = str(tombstone.get("withdrawn_utc", intent.withdrawn_utc if intent else ""))
    begun_facts = tombstone.get("begun")
    if begun_facts is None and intent is not None and (intended_session := intent.sessions.get(folder.name)):
        begun_facts = {"protocol": intended_session.protocol}
    protocol = str(begun_facts.get("protocol", "")) if isinstance(begun_facts, dict) else ""
    remark = "The participant withdrew; the data were erased."
    if unfinished_text := describe_unfinished(folder):
        remark = f"The participant withdrew, and not everything is erased. {unfinished_text}"
    return SessionLine(
        folder.name, str(folder.path), folder.subject, protocol, withdrawn_utc, None, 0, 0, 0, "withdrawn", remark
    )


def _stamp_files(folder: SessionFolder) -> tuple[tuple[str, int, int, int], ...]:
    """Name, time of modification and of status change (ns) and size (bytes) of all files that determine the line.
    Raises OSError if there is no log."""
    result_files = (path for path in (*find_seals(folder.path).values(), folder.path / SUMMARY_NAME) if path.exists())
    statuses = ((path.name, path.stat()) for path in (folder.log, *result_files))
    return tuple((name, status.st_mtime_ns, status.st_ctime_ns, status.st_size) for name, status in statuses)


@lru_cache(maxsize=4096)
def _make_cached_line(folder: SessionFolder, file_stamp: tuple[tuple[str, int, int, int], ...]) -> SessionLine:
    """The line of a session that is not withdrawn. file_stamp: key of the cache; the result depends only on the files
    that it describes. Raises StudyError, OSError."""
    content = read_regular(folder.log)
    session_opened = read_opening(folder.log)
    is_trusted = (
        isinstance(session_opened, SessionOpened)
        and session_opened.session == folder.name
        and is_sealed(folder.path, content)
    )
    is_trusted = is_trusted and MEASURED_EVENT in content  # a person who does not take part left a short log
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
    )


@lru_cache(maxsize=64)
def _read_name_and_run_count(protocol_text: str) -> tuple[str, int] | None:
    """Name and number of runs of a study protocol; None for text that is not one."""
    try:
        protocol = load_protocol(protocol_text, "the log")
    except ProtocolError:
        return None
    # How many there are depends on neither seed nor participant: only their order does.
    return (protocol.name, len(schedule_runs(protocol, 0, 0))) if isinstance(protocol, StudyProtocol) else None
