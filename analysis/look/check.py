"""Result type of the plausibility checks of a recording: severity, finding and advice, in sentences for the user."""

from dataclasses import dataclass
from typing import Literal

Level = Literal["fine", "notice", "wrong"]
"""Severity. `wrong`: a defect that would mislead an analysis; `notice`: a fact that the user should know; `fine`:
passed."""


@dataclass(frozen=True, slots=True)
class Check:
    """Result of one check of a recording."""

    name: str
    """Name of the check, such as "clipping"."""
    level: Level
    finding: str
    """Sentence with numbers and units."""
    advice: str = ""
    """Sentence; empty where no action is needed."""


UNDRIVEN_ADVICE = "Its effect cannot be determined; leave it out, or record it driven."
FREE_ADVICE = "In a free motion, such as a decay, keep it: a recording needs a command; otherwise record it driven."
"""Advice on a command that does not change: where another one changes, and where none does."""


def add_fine_if_none(name: str, checks: tuple[Check, ...], text: str) -> tuple[Check, ...]:
    """Return the checks or, if there are none, a single passed check with this name and text."""
    return checks or (Check(name, "fine", text),)
