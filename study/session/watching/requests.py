"""Requests to a running session (stop, pause, note), from another terminal, from a key, or from the program itself.

These are plain values; `study.store.sessions.request_inbox` transfers those of other programs as files, and
`study.workflows.trial.session_supervisor` executes them.
"""

from dataclasses import dataclass
from typing import Literal

RequestSource = Literal["participant", "experimenter", "program"]
"""Origin of a request; `program`: the session's own program, such as an alarm of the supervisor."""


@dataclass(frozen=True, slots=True)
class StopAsked:
    """Request to stop: the force is switched off at once and the sitting ends; the session can be resumed."""

    who: RequestSource
    """Origin of the request."""


@dataclass(frozen=True, slots=True)
class PauseAsked:
    """Request to pause: the force ends at once; the present trial is void and is presented again."""

    who: RequestSource
    """Origin of the request."""


@dataclass(frozen=True, slots=True)
class NoteAsked:
    """Request to write a note into the log."""

    who: RequestSource
    """Author of the note."""
    text: str
    adverse: bool = False
    """Whether the note reports an adverse event of the participant, such as pain, numbness or fright."""


Request = StopAsked | PauseAsked | NoteAsked
"""Any request to a running session."""
