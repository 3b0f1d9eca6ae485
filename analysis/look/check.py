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


def add_fine_if_none(name: str, checks: tuple[Check, ...], text: str) -> tuple[Check, ...]:
    """Return the checks or, if there are none, a single passed check with this name and text."""
    return checks or (Check(name, "fine", text),)
