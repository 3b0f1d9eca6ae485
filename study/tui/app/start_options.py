"""Start options of the application, as the command line passes them to `app.HapteqApp`."""

from dataclasses import dataclass

from study.tui.engine.to_engine import BeginSession, Resume
from study.tui.keys.answer_keys import DIGITS, AnswerKeys


@dataclass(frozen=True, slots=True)
class StartOptions:
    """Data folder, device, answer keys, a sitting to begin at once, and defaults of the start screen."""

    data: str
    device: str
    """Name of the device, as `study.devices.opening.open_device` takes it."""
    keys: AnswerKeys = DIGITS
    """Keys for the answers 1 and 2."""
    first_sitting: BeginSession | Resume | None = None
    """Sitting with which the application begins; None shows the start screen."""
    protocol: str = ""
    """Protocol that the start screen lists first, by name or path; empty for none."""
    seed: int | None = None
    """Seed of the random numbers of every new session; None draws a new seed for each."""
    model: str = ""
    """File of the identified model that equalizes the stimuli of every new session; empty for none."""
