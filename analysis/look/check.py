"""Result of a single check of a recording: its level, what was found, and advice, in sentences for the user.

All checks of this package return it, so that `overview` can list and sort them alike.
"""

from dataclasses import dataclass
from typing import Literal

Level = Literal["fine", "notice", "wrong"]
"""`wrong`: a defect that would mislead an analysis; `notice`: a fact that the user should know; `fine`: in order."""


@dataclass(frozen=True, slots=True)
class Check:
    """Result of a check, with its level and advice."""

    name: str
    """Name of the check, such as "clipping"."""
    level: Level
    seen: str
    """One sentence, with numbers and units."""
    do: str = ""
    """Advice; empty where there is nothing to do."""


def add_fine_if_none(name: str, checks: tuple[Check, ...], text: str) -> tuple[Check, ...]:
    """The checks; where there are none, a single "fine" check with this name and text."""
    return checks or (Check(name, "fine", text),)
