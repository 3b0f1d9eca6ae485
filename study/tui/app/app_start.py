"""What the command line asks of the application. Light to import."""

from dataclasses import dataclass

from study.tui.engine.to_engine import Begin, Resume
from study.tui.keys.answer_keys import DIGITS, AnswerKeys


@dataclass(frozen=True, slots=True)
class AppStart:
    data: str
    device: str
    keys: AnswerKeys = DIGITS
    first: Begin | Resume | None = None
    """Goes straight into this sitting; None shows the start screen."""
    protocol: str = ""
    """What the start screen proposes first; empty leaves it to the list."""
    seed: int | None = None
    """Of every session that is begun; None draws one each time."""
    model: str = ""
    """File of the identified model that equalizes the stimuli of every session that is begun; empty: none does."""
