"""Validation and suggestion of participant codes: 1 to 16 ASCII letters and digits with at least one digit."""

import re

CODE_RULE = "a code has 1 to 16 letters and digits, at least one digit, such as P01"
"""The rule in words, for messages."""

_CODE_PATTERN = re.compile(r"(?=.*\d)[A-Za-z0-9]{1,16}")
_NUMBERED_CODE_PATTERN = re.compile(r"(?P<letters>[A-Za-z]*)(?P<digits>\d{1,9})")
"""Matches a code of letters (or none) and then 1 to 9 digits, from which the next code can be derived."""


def is_code(text: str) -> bool:
    """Whether the text is a valid participant code."""
    return _CODE_PATTERN.fullmatch(text) is not None


def explain_invalid_code(text: str) -> str:
    """Explain in a sentence why a code is invalid; empty if it is valid."""
    if is_code(text):
        return ""
    if not text.strip():
        return f"A code is needed: {CODE_RULE.removeprefix('a code has ')}."
    return f"'{text}' is no participant code; {CODE_RULE}."


def suggest_code(used_codes: tuple[str, ...]) -> str:
    """Suggest the next code. The latest code such as P07 (`_NUMBERED_CODE_PATTERN`) sets the letters and the least
    number of digits; the number is one more than the highest that was used with these letters. P01 if there is no such
    code, or if the result were longer than 16 characters. used_codes: the latest first."""
    for code in used_codes:
        match = _NUMBERED_CODE_PATTERN.fullmatch(code)
        if match is None:
            continue
        letters, digit_count = match["letters"], len(match["digits"])
        numbers = [
            int(code_match["digits"])
            for code_match in map(_NUMBERED_CODE_PATTERN.fullmatch, used_codes)
            if code_match and code_match["letters"] == letters
        ]
        next_code = f"{letters}{max(numbers) + 1:0{digit_count}d}"
        return next_code if is_code(next_code) else "P01"
    return "P01"
