"""Options that the command line passes to the application.

The module imports nothing heavy, so that the first frame appears soon.
"""

from dataclasses import dataclass

from study.tui.engine.to_engine import BeginSession, Resume
from study.tui.keys.answer_keys import DIGITS, AnswerKeys


@dataclass(frozen=True, slots=True)
class AppStart:
    """Options of the command line: data folder, device, answer keys, and what the start screen preselects."""

    data: str
    """Path of the data folder."""
    device: str
    """Name of the device."""
    keys: AnswerKeys = DIGITS
    """Keys that answer 1 and 2."""
    first: BeginSession | Resume | None = None
    """Start directly with this sitting; None shows the start screen."""
    protocol: str = ""
    """Protocol that the start screen lists first, by name or path; empty for none."""
    seed: int | None = None
    """Seed of every new session; None draws a new seed for each."""
    model: str = ""
    """File of the identified model that equalizes the stimuli of every new session; empty for none."""
