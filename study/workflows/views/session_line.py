"""One line per session in a list. Read only.

A list must be fast: the log of a finished session whose checksums and seal hold is trusted and counted without being
parsed. Every other log is folded.
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
from study.store.sessions.log_seal import find_seals, is_sealed
from study.store.sessions.log_writer import is_log_locked
from study.store.sessions.session_summary import SUMMARY_NAME
from study.store.sessions.withdrawal_files import describe_unfinished, read_intent, read_tombstone
from study.workflows.results.fold_session import fold_session

MEASURED = b',"event":"trial_measured",'
"""In the line of a log that closes a trial: counted without parsing."""


def session_line(folder: SessionFolder) -> SessionLine:
    """The line; an unreadable session has a remark. Raises nothing."""
    try:
        if folder.withdrawn:
            return _withdrawn_line(folder)
        line = _line(folder, _stamp(folder))
    except FileNotFoundError:
        return unreadable(folder, "It has no log: the program died while it was made.")
    except StudyError as problem:
        return unreadable(folder, problem.happened)
    except OSError as problem:
        return unreadable(folder, f"The system refused: {problem.strerror or problem}.")
    return with_writer(line, folder)


def with_writer(line: SessionLine, folder: SessionFolder) -> SessionLine:
    """The line marked `running` if the session is being written right now; the lock is probed for some microseconds."""
    if line.standing == "unfinished" and is_log_locked(folder.log):
        return replace(line, standing="running")
    return line


def line_of(state: SessionState, folder: SessionFolder) -> SessionLine:
    """The session as a line of a list, from its folded log; never `running`, see `with_writer`."""
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


def unreadable(folder: SessionFolder, remark: str) -> SessionLine:
    """Line of an unreadable session; its start is unknown, so it is sorted by the last change of its folder."""
    try:
        changed_utc = datetime.fromtimestamp(folder.path.stat().st_mtime, UTC).isoformat(timespec="seconds")
    except OSError:
        changed_utc = ""
    return SessionLine(
        folder.name, str(folder.path), folder.subject, "", changed_utc, None, 0, 0, 0, "unreadable", remark
    )


def _withdrawn_line(folder: SessionFolder) -> SessionLine:
    tombstone = read_tombstone(folder)  # its existence is information enough
    intent = read_intent(folder.path.parent, folder.subject)
    withdrawn_utc = str(tombstone.get("withdrawn_utc", intent.withdrawn_utc if intent else ""))
    begun_facts = tombstone.get("begun")
    if begun_facts is None and intent is not None and (promised := intent.sessions.get(folder.name)):
        begun_facts = {"protocol": promised.protocol}
    protocol = str(begun_facts.get("protocol", "")) if isinstance(begun_facts, dict) else ""
    remark = "The participant withdrew; the data were erased."
    if finish := describe_unfinished(folder):
        remark = f"The participant withdrew, and not everything is erased. {finish}"
    return SessionLine(
        folder.name, str(folder.path), folder.subject, protocol, withdrawn_utc, None, 0, 0, 0, "withdrawn", remark
    )


def _stamp(folder: SessionFolder) -> tuple[tuple[str, int, int, int], ...]:
    """Times and sizes of all files that determine the line. Raises OSError if there is no log."""
    result_files = (path for path in (*find_seals(folder.path).values(), folder.path / SUMMARY_NAME) if path.exists())
    stats = ((path.name, path.stat()) for path in (folder.log, *result_files))
    return tuple((name, stat.st_mtime_ns, stat.st_ctime_ns, stat.st_size) for name, stat in stats)


@lru_cache(maxsize=4096)
def _line(folder: SessionFolder, stamp: tuple[tuple[str, int, int, int], ...]) -> SessionLine:
    """The line; depends only on the files that `stamp` represents (cached). Raises StudyError, OSError."""
    content = read_regular(folder.log)
    session_opened = read_opening(folder.log)
    is_trusted = (
        isinstance(session_opened, SessionOpened)
        and session_opened.session == folder.name
        and is_sealed(folder.path, content)
    )
    is_trusted = is_trusted and MEASURED in content  # a person who does not take part left a short log
    planned = (
        _protocol_and_runs(session_opened.protocol_text)
        if is_trusted and isinstance(session_opened, SessionOpened)
        else None
    )
    if planned is None or not isinstance(session_opened, SessionOpened):
        return line_of(fold_session(folder).state, folder)
    protocol, run_count = planned
    return SessionLine(
        name=folder.name,
        path=str(folder.path),
        subject=folder.subject,
        protocol=protocol,
        begun_utc=session_opened.utc,
        observer=session_opened.observer,
        answers=content.count(MEASURED),
        runs_done=run_count,
        runs=run_count,
        standing="finished",
    )


@lru_cache(maxsize=64)
def _protocol_and_runs(protocol_text: str) -> tuple[str, int] | None:
    """Name and number of runs; None for text that is not a study protocol."""
    try:
        protocol = load_protocol(protocol_text, "the log")
    except ProtocolError:
        return None
    # How many there are depends on neither seed nor participant: only their order does.
    return (protocol.name, len(schedule_runs(protocol, 0, 0))) if isinstance(protocol, StudyProtocol) else None
