"""Read a session: fold its log, checking every logged level against the rules. Changes nothing."""

from dataclasses import dataclass

from protocols.hashing import protocol_hash
from protocols.loading import ProtocolError, load_protocol
from protocols.study_protocol import StudyProtocol
from study.errors import StudyError
from study.session.draw_check import LogContradiction
from study.session.events import SessionOpened
from study.session.fold import apply, begin_session
from study.session.state import SessionState
from study.store.archive import SessionFolder, SessionWithdrawnError
from study.store.event_log import LogContents, read_log


@dataclass(frozen=True, slots=True)
class FoldedSession:
    state: SessionState
    contents: LogContents


def fold_session(folder: SessionFolder) -> FoldedSession:
    """Read a session without changing anything. Raises StudyError where the log contradicts itself or the rules, and
    for a session that was withdrawn."""
    if folder.withdrawn:
        raise SessionWithdrawnError(folder)
    contents = read_log(folder.log)
    if not contents.events or not isinstance(contents.events[0], SessionOpened):
        raise StudyError(
            "This session never began",
            f"The log of {folder.name} has no opening line; the program died while it was made.",
            "Start a new session; the folder holds no answers and may be deleted.",
        )
    opened = contents.events[0]
    if (opened.session, opened.subject) != (folder.name, folder.subject):
        raise StudyError(
            "This log belongs to another session",
            f"{folder.name} holds the log of {opened.session}: the folder was copied or renamed.",
            "Give the folder its own name back, or take the copy away.",
            saved="Nothing was changed.",
        )
    number = 1
    try:
        state = begin_session(opened, protocol_of(opened, folder))
        for event in contents.events[1:]:
            number += 1
            state = apply(state, event)
    except (LogContradiction, ArithmeticError) as problem:
        raise StudyError(
            "The session log contradicts the rules",
            f"Line {number} of {folder.name}: {problem}.",
            "If the log was edited, restore it from a copy; if not, use the hapteq that began it (first line).",
            saved="Nothing was changed; every answer is still in the log.",
        ) from problem
    return FoldedSession(state, contents)


def protocol_of(opened: SessionOpened, folder: SessionFolder) -> StudyProtocol:
    """The protocol that a log carries. Raises StudyError where it cannot be read, or is not the one that was begun."""
    try:
        protocol = load_protocol(opened.protocol_text, f"the log of {folder.name}")
    except ProtocolError as problem:
        begun_by = opened.versions.get("hapteq", "another version")
        raise StudyError(
            "The protocol in the log cannot be read",
            f"{problem} The session was begun by hapteq {begun_by}.",
            "Use that version, or restore events.jsonl from a copy.",
            saved="Nothing was changed.",
        ) from problem
    if not isinstance(protocol, StudyProtocol):
        raise StudyError(
            "This is no study session", f"The protocol in the log of {folder.name} is a recording.", "Check the folder."
        )
    if protocol_hash(protocol) != opened.protocol_hash:
        raise StudyError(
            "The protocol in the log was changed",
            f"The protocol text of {folder.name} does not match the hash written beside it.",
            "Restore events.jsonl from a copy.",
            saved="Nothing was changed.",
        )
    return protocol
