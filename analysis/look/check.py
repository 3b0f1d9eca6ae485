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


def fine_if_none(name: str, found: tuple[Check, ...], text: str) -> tuple[Check, ...]:
    """The findings, or where there are none a single "fine" check of this name with this text."""
    return found or (Check(name, "fine", text),)
