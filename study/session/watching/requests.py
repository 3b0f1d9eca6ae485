"""Requests to a running session, from another terminal, from a key, or from the program itself.

Plain values: the request inbox (`study.store.sessions.request_inbox`) carries them, and the session obeys.
"""

from dataclasses import dataclass
from typing import Literal

RequestSource = Literal["participant", "experimenter", "program"]
"""Origin of a request; `program`: a finding of the session itself."""


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
"""Any request to a running session."""
