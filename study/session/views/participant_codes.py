"""Valid participant codes: the same rule for screens, command line and stored files.

A code is 1 to 16 ASCII letters and digits with at least one digit, such as P01.
The module has no state and is quick to import.
"""

import re

ALLOWED = "a code has 1 to 16 letters and digits, at least one digit, such as P01"
"""The rule in words, as a part of messages."""

_CODE = re.compile(r"(?=.*\d)[A-Za-z0-9]{1,16}")
"""The rule as a pattern."""
_NUMBERED_CODE = re.compile(r"(?P<letters>[A-Za-z]*)(?P<digits>\d{1,9})")
"""Codes that can be continued by the next number: letters, then up to nine digits."""


def is_code(text: str) -> bool:
    """Whether the text is a valid participant code."""
    return _CODE.fullmatch(text) is not None


def code_problem(text: str) -> str:
    """What is wrong with a code, as a sentence; empty if it is valid."""
    if is_code(text):
        return ""
    if not text.strip():
        return f"A code is needed: {ALLOWED.removeprefix('a code has ')}."
    return f"'{text}' is no participant code; {ALLOWED}."


def suggest_code(used_codes: tuple[str, ...]) -> str:
    """A free code: the latest numbered code with the next number of its letters; P01 without such a code. used_codes:
    the latest first."""
    for code in used_codes:
        match = _NUMBERED_CODE.fullmatch(code)
        if match is None:
            continue
        letters, width = match["letters"], len(match["digits"])
        numbers = [int(m["digits"]) for m in map(_NUMBERED_CODE.fullmatch, used_codes) if m and m["letters"] == letters]
        proposed = f"{letters}{max(numbers) + 1:0{width}d}"
        return proposed if is_code(proposed) else "P01"
    return "P01"
