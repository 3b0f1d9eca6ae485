"""Read a session: compute its state from the events of its log, applied in order (a fold, as in event sourcing).

Lines are checked against their checksums (older logs have none), presentations against the rules of the protocol, and
the log against its seals and, for an open session, the stored results. Nothing on disk is changed.
"""

from dataclasses import dataclass

from protocols.definition.study_protocol import StudyProtocol
from protocols.document.hashing import hash_protocol
from protocols.document.loading import ProtocolError, load_protocol
from study.errors import StudyError
from study.session.facts.events import SessionOpened
from study.session.state.fold import apply_event
from study.session.state.presentation_check import LogContradictionError
from study.session.state.state import SessionState, begin_session
from study.store.sessions.archive import SessionFolder, SessionWithdrawnError
from study.store.sessions.event_log import LogContents, read_log
from study.store.sessions.log_seal import check_seals, find_seals
from study.store.sessions.session_summary import SUMMARY_NAME, read_closed_and_presentations, read_summary


@dataclass(frozen=True, slots=True)
class FoldedSession:
    """A session read from its log: its state and the log's content."""

    state: SessionState
    """State after the last event."""
    log_contents: LogContents
    """Events and bytes of the log."""
    sealed_lines: int
    """Number of lines of the log that a seal covers; 0 without a seal."""

    @property
    def seal_due(self) -> bool:
        """Whether a seal must be written: the session is closed, its log has checksums, and no seal exists. A log
        without checksums is never sealed, because its content cannot be verified."""
        return self.state.closed and bool(self.log_contents.chain.first_checksum_line) and not self.sealed_lines


def fold_session(folder: SessionFolder) -> FoldedSession:
    """Read a session without changing it. Raises StudyError where the log cannot be read, is damaged or incomplete,
    belongs to another session, or contradicts the rules, the seals or the stored results; SessionWithdrawnError, a
    StudyError, for a withdrawn session."""
    if folder.withdrawn:
        raise SessionWithdrawnError(folder)
    log_contents = read_log(folder.log)
    if not log_contents.events or not isinstance(log_contents.events[0], SessionOpened):
        raise _make_unopened_error(folder, log_contents)
    session_opened = log_contents.events[0]
    if (session_opened.session, session_opened.subject) != (folder.name, folder.subject):
        raise StudyError(
            "This log belongs to another session",
            f"{folder.name} holds the log of {session_opened.session}: the folder was copied or renamed.",
            "Give the folder its own name back, or take the copy away.",
            saved="Nothing was changed.",
        )
    line_number = 1
    try:
        state = begin_session(session_opened, load_logged_protocol(session_opened, folder))
        for event in log_contents.events[1:]:
            line_number += 1
            state = apply_event(state, event)
    except (LogContradictionError, ArithmeticError) as problem:
        raise StudyError(
            "The session log contradicts the rules",
            f"Line {line_number} of {folder.name}: {problem}.",
            "If the log was edited, restore it from a copy; if not, use the hapteq that began it (first line).",
            saved="Nothing was changed; every answer is still in the log.",
        ) from problem
    sealed_lines = check_seals(folder.path, log_contents)
    if not state.closed:
        _require_complete_log(state, folder)
    return FoldedSession(state, log_contents, sealed_lines)


def _make_unopened_error(folder: SessionFolder, log_contents: LogContents) -> StudyError:
    """Make the error for a log without opening line: of a session that never began, or a log whose beginning was lost,
    where further lines, results or recordings exist."""
    has_results = (folder.path / SUMMARY_NAME).exists() or bool(find_seals(folder.path))
    if log_contents.events or has_results or any(folder.recordings.glob("*.h5")):
        return StudyError(
            "The beginning of this session's log is missing",
            f"{folder.log.name} of {folder.name} has no opening line, but the folder holds data of a session.",
            f"Keep the folder as it is, and restore {folder.log.name} from a copy.",
            saved="Nothing was changed.",
        )
    return StudyError(
        "This session never began",
        f"The log of {folder.name} has no opening line; the program died while it was made.",
        "Start a new session; the folder holds no answers and may be deleted.",
    )


def _require_complete_log(state: SessionState, folder: SessionFolder) -> None:
    """Raise StudyError where the stored results of an open session cover more presentations than the log, or a closed
    session: the end of the log was lost. Otherwise the log would look like that of an interrupted session."""
    is_closed, presentation_count = read_closed_and_presentations(read_summary(folder.path))
    if is_closed or presentation_count > len(state.trials):
        covered_text = "a finished session" if is_closed else f"{presentation_count} presentations"
        raise StudyError(
            "The end of this session's log is missing",
            f"{SUMMARY_NAME} of {folder.name} was made from {covered_text}; the log ends before that, after "
            f"{len(state.trials)} presentations.",
            "Restore events.jsonl from a copy.",
            saved="Nothing was changed.",
        )


def load_logged_protocol(session_opened: SessionOpened, folder: SessionFolder) -> StudyProtocol:
    """Parse the protocol stored in a log. Raises StudyError where it cannot be parsed, is no study protocol, or does
    not match its hash."""
    try:
        protocol = load_protocol(session_opened.protocol_text, f"the log of {folder.name}")
    except ProtocolError as problem:
        writer_version = session_opened.versions.get("hapteq", "another version")
        raise StudyError(
            "The protocol in the log cannot be read",
            f"{problem} The session was begun by hapteq {writer_version}.",
            "Use that version, or restore events.jsonl from a copy.",
            saved="Nothing was changed.",
        ) from problem
    if not isinstance(protocol, StudyProtocol):
        raise StudyError(
            "This is no study session", f"The protocol in the log of {folder.name} is a recording.", "Check the folder."
        )
    if hash_protocol(protocol) != session_opened.protocol_hash:
        raise StudyError(
            "The protocol in the log was changed",
            f"The protocol text of {folder.name} does not match the hash written beside it.",
            "Restore events.jsonl from a copy.",
            saved="Nothing was changed.",
        )
    return protocol
