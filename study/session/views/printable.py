"""Removes control characters from text of files before it is shown in a terminal.

Control characters in a note or a damaged file could otherwise move the cursor or clear the screen.
"""

import dataclasses
from typing import Any, TypeVar

T = TypeVar("T")


def printable_text(text: str) -> str:
    """The text with each non-printable character replaced by a blank; line ends are kept."""
    if text.isprintable():
        return text
    return "".join(c if c.isprintable() or c == "\n" else " " for c in text)


def printable(view: T) -> T:
    """A copy of a value of dataclasses, tuples and text, in which `printable_text` is applied to all text."""
    cleaned: T = _clean(view)
    return cleaned


def _clean(value: Any) -> Any:
    if isinstance(value, str):
        return printable_text(value)
    if isinstance(value, tuple):
        return tuple(map(_clean, value))
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        names = (field.name for field in dataclasses.fields(value))
        return dataclasses.replace(value, **{name: _clean(getattr(value, name)) for name in names})
    return value
