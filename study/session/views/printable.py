"""Replace non-printable characters in text from files by blanks, before it is shown in a terminal.

Control characters in a note or a damaged file could otherwise move the cursor or clear the screen.
"""

import dataclasses
from typing import Any, TypeVar

T = TypeVar("T")


def replace_unprintable(text: str) -> str:
    """Replace each non-printable character (`str.isprintable`) by a blank; newlines are kept, carriage returns not."""
    if text.isprintable():
        return text
    return "".join(character if character.isprintable() or character == "\n" else " " for character in text)


def make_printable(view: T) -> T:
    """Copy a value of nested dataclasses and tuples, with `replace_unprintable` applied to the strings in them; values
    of other types, lists and dictionaries included, are kept unchanged."""
    printable_view: T = _replace_in_value(view)
    return printable_view


def _replace_in_value(value: Any) -> Any:
    """Apply `make_printable` recursively to one value."""
    if isinstance(value, str):
        return replace_unprintable(value)
    if isinstance(value, tuple):
        return tuple(map(_replace_in_value, value))
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        field_names = (field.name for field in dataclasses.fields(value))
        return dataclasses.replace(value, **{name: _replace_in_value(getattr(value, name)) for name in field_names})
    return value
