"""Text from files, made fit for a terminal: a note or a damaged file must not move its cursor or clear its screen."""

import dataclasses
from typing import Any, TypeVar

T = TypeVar("T")


def printable_text(text: str) -> str:
    """Control characters are shown as blanks; line ends stay."""
    if text.isprintable():
        return text
    return "".join(c if c.isprintable() or c == "\n" else " " for c in text)


def printable(view: T) -> T:
    """A value of dataclasses, tuples and text, with all its text made printable."""
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
