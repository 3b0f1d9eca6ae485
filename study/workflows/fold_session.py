"""Read a session: fold its log, checking every logged level against the rules. Changes nothing."""

from dataclasses import dataclass

from protocols.hashing import protocol_hash
from protocols.loading import load_protocol
from protocols.study_protocol import StudyProtocol
from study.errors import StudyError
from study.session.events import SessionOpened
from study.session.state import LogContradiction, SessionState, apply, begin_session
from study.store.archive import SessionFolder
from study.store.event_log import LogContents, read_log


@dataclass(frozen=True, slots=True)
class FoldedSession:
    state: SessionState
    contents: LogContents


def fold_session(folder: SessionFolder) -> FoldedSession:
    """Read a session without changing anything. Raises StudyError where the log contradicts itself or the rules."""
    contents = read_log(folder.log)
    if not contents.events or not isinstance(contents.events[0], SessionOpened):
        raise StudyError(
            "This session never began",
            f"The log of {folder.name} has no opening line; the program died while it was made.",
            "Start a new session; the folder holds no answers and may be deleted.",
        )
    opened = contents.events[0]
    state = begin_session(opened, _protocol_of(opened, folder))
    for number, event in enumerate(contents.events[1:], start=2):
        try:
            state = apply(state, event)
        except LogContradiction as problem:
            raise StudyError(
                "The session log contradicts the rules",
                f"Line {number} of {folder.name}: {problem}.",
                "Resume with the program version that began it (first line of the log), or start a new session.",
                saved="Nothing was changed; every answer is still in the log.",
            ) from problem
    return FoldedSession(state, contents)


def _protocol_of(opened: SessionOpened, folder: SessionFolder) -> StudyProtocol:
    protocol = load_protocol(opened.protocol_text, f"the log of {folder.name}")
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
