"""Requests to a running session from another terminal or from a key outside the trial. Values only."""

from dataclasses import dataclass
from typing import Literal

Who = Literal["participant", "experimenter", "program"]
"""Who asks; `program`: a finding of the session itself."""


@dataclass(frozen=True, slots=True)
class StopAsked:
    """Force off at once; the sitting ends and can be resumed."""

    who: Who


@dataclass(frozen=True, slots=True)
class PauseAsked:
    """Hands free at once; the present trial is void and comes again."""

    who: Who


@dataclass(frozen=True, slots=True)
class NoteAsked:
    """Write this into the log."""

    who: Who
    text: str
    adverse: bool = False
    """Something happened to the participant: pain, numbness, a fright."""


Request = StopAsked | PauseAsked | NoteAsked
"""Any request to a running session."""
