"""Strict parsing of JSON: NaN, infinity, duplicate keys, lone surrogates, deep nesting and huge numbers are refused.

The JSON module of Python accepts most of them; they would fail later, in other code or in other programs.
"""

import json
import math
from typing import Any

MAX_DEPTH = 64
"""Largest depth of nesting of a document, well below the recursion limit of Python."""
_LONGEST_NUMBER = 40
"""Largest number of digits of a whole number; a seed of 128 bits has up to 39."""


def load_json(text: str | bytes, *, with_nan: bool = False) -> Any:
    """Parse JSON. with_nan: NaN and infinity are accepted. Raises only ValueError, with a sentence fragment."""
    try:
        document = json.loads(
            text,
            parse_constant=None if with_nan else _refuse,
            parse_float=_parse_finite,
            parse_int=_parse_whole,
            object_pairs_hook=_refuse_duplicate_keys,
        )
    except RecursionError:
        raise ValueError("it is nested too deeply") from None
    _check_document(document)
    return document


def _check_document(document: Any) -> None:
    """Raise ValueError for nesting deeper than `MAX_DEPTH` and for texts with lone surrogates. Without recursion."""
    waiting = [(document, 0)]
    while waiting:
        value, depth = waiting.pop()
        if depth > MAX_DEPTH:
            raise ValueError(f"it is nested more than {MAX_DEPTH} levels deep")
        if isinstance(value, dict):
            waiting += ((member, depth + 1) for entry in value.items() for member in entry)
        elif isinstance(value, list):
            waiting += ((member, depth + 1) for member in value)
        elif isinstance(value, str):
            try:
                value.encode()
            except UnicodeEncodeError:
                raise ValueError("a text in it has half of a character (a lone surrogate)") from None


def _refuse_duplicate_keys(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    """An object as a dictionary. Raises ValueError for a duplicate key, of which Python would keep the last value."""
    record = dict(pairs)
    if len(record) < len(pairs):
        names = [name for name, _ in pairs]
        raise ValueError(f"a record in it has '{max(names, key=names.count)}' twice")
    return record


def _refuse(constant: str) -> None:
    """Raise ValueError for NaN, Infinity and -Infinity."""
    raise ValueError(f"JSON has no {constant}; write null")


def _parse_finite(digits: str) -> float:
    """A finite number. Raises ValueError for one beyond the range of floats, which Python reads as infinity."""
    number = float(digits)
    if not math.isfinite(number):
        raise ValueError(f"the number {digits[:30]} is larger than any that is read")
    return number


def _parse_whole(digits: str) -> int:
    """A whole number. Raises ValueError for more than `_LONGEST_NUMBER` digits."""
    if len(digits) > _LONGEST_NUMBER + digits.startswith("-"):
        raise ValueError(f"a whole number in it has {len(digits)} digits; up to {_LONGEST_NUMBER} are read")
    return int(digits)
