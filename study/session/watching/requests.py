"""Requests to a running session (stop, pause, note), from another terminal, from a key, or from the program itself.

Requests of other programs are transferred as files (`study.store.sessions.request_inbox`).
"""

from dataclasses import dataclass
from typing import Literal

RequestSource = Literal["participant", "experimenter", "program"]
"""Origin of a request; `program`: the session's own program, such as an alarm of the supervisor."""


@dataclass(frozen=True, slots=True)
class StopAsked:
    """Request to stop: the force is switched off at once and the sitting ends; the session can be resumed."""

    who: RequestSource


@dataclass(frozen=True, slots=True)
class PauseAsked:
    """Request to pause: the force ends at once; the present trial is void and is presented again."""

    who: RequestSource


@dataclass(frozen=True, slots=True)
class NoteAsked:
    """Request to write a note into the log."""

    who: RequestSource
    text: str
    adverse: bool = False
    """Whether the note reports an adverse event of the participant, such as pain, numbness or fright."""


Request = StopAsked | PauseAsked | NoteAsked
