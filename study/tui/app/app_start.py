"""Options that the command line gives to the application. Light to import."""

from dataclasses import dataclass

from study.tui.engine.to_engine import Begin, Resume
from study.tui.keys.answer_keys import DIGITS, AnswerKeys


@dataclass(frozen=True, slots=True)
class AppStart:
    """Options of the command line: data folder, device, keys, and what is offered first."""

    data: str
    device: str
    keys: AnswerKeys = DIGITS
    first: Begin | Resume | None = None
    """Start directly with this sitting; None shows the start screen."""
    protocol: str = ""
    """First choice of the start screen; empty for none."""
    seed: int | None = None
    """Seed of every new session; None draws one each time."""
    model: str = ""
    """Identified model that equalizes the stimuli of every new session; empty for none."""
