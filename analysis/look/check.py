"""Result of a single check of a recording."""

from dataclasses import dataclass
from typing import Literal

Level = Literal["fine", "notice", "wrong"]
"""`wrong` would mislead an analysis; `notice` should be known; `fine` was checked and is in order."""


@dataclass(frozen=True, slots=True)
class Check:
    """Result of a check, with its level and advice."""

    name: str
    """Name of the check: "clipping"."""
    level: Level
    seen: str
    """One sentence, with numbers and units."""
    do: str = ""
    """Advice; empty where there is nothing to do."""


def fine_if_none(name: str, found: tuple[Check, ...], text: str) -> tuple[Check, ...]:
    """The findings, or one check that says that there are none."""
    return found or (Check(name, "fine", text),)
