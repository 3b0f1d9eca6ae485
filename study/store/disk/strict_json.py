"""Parse JSON strictly: NaN, infinity, duplicate keys, lone surrogates, deep nesting and huge numbers are refused.

The JSON module of Python accepts most of them; they would fail later, in other code or in other programs.
"""

import json
import math
from typing import Any

MAX_DEPTH = 64
"""Largest depth of a value; the document itself has depth 0. Chosen, far below the recursion limit of Python, 1000."""
_MAX_DIGITS = 40
"""Largest number of decimal digits of an integer, without sign. Chosen: a seed of 128 bits has up to 39."""


def load_json(text: str | bytes, *, with_nan: bool = False) -> Any:
    """Parse a JSON document. with_nan: accept NaN, Infinity and -Infinity. Raises ValueError for invalid JSON, bytes
    that are no Unicode text, and what the module refuses."""
    try:
        document = json.loads(
            text,
            parse_constant=None if with_nan else _refuse_constant,
            parse_float=_parse_finite,
            parse_int=_parse_integer,
            object_pairs_hook=_refuse_duplicate_keys,
        )
    except RecursionError:
        raise ValueError("it is nested too deeply") from None
    _check_document(document)
    return document


def _check_document(document: Any) -> None:
    """Raise ValueError for a value or key deeper than `MAX_DEPTH`, or with a lone surrogate. Iterative, so that deep
    nesting cannot exceed the recursion limit."""
    pending_values = [(document, 0)]
    while pending_values:
        value, depth = pending_values.pop()
        if depth > MAX_DEPTH:
            raise ValueError(f"it is nested more than {MAX_DEPTH} levels deep")
        if isinstance(value, dict):
            pending_values += ((member, depth + 1) for entry in value.items() for member in entry)
        elif isinstance(value, list):
            pending_values += ((member, depth + 1) for member in value)
        elif isinstance(value, str):
            try:
                value.encode()
            except UnicodeEncodeError:
                raise ValueError("a text in it has half of a character (a lone surrogate)") from None


def _refuse_duplicate_keys(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    """Make the dictionary of a JSON object. Raises ValueError for a duplicate key, of which Python would keep the last
    value."""
    json_object = dict(pairs)
    if len(json_object) < len(pairs):
        keys = [key for key, _ in pairs]
        raise ValueError(f"a record in it has '{max(keys, key=keys.count)}' twice")
    return json_object


def _refuse_constant(constant: str) -> None:
    """Raise ValueError; the JSON module calls this for NaN, Infinity and -Infinity."""
    raise ValueError(f"JSON has no {constant}; write null")


def _parse_finite(number_text: str) -> float:
    """Parse a number with fraction or exponent. Raises ValueError where it exceeds the range of float64, which Python
    would read as infinity."""
    number = float(number_text)
    if not math.isfinite(number):
        # 30 characters identify the number; it may have any length.
        raise ValueError(f"the number {number_text[:30]} is larger than any that is read")
    return number


def _parse_integer(digits: str) -> int:
    """Parse an integer. Raises ValueError for more than `_MAX_DIGITS` digits."""
    if len(digits) > _MAX_DIGITS + digits.startswith("-"):
        raise ValueError(f"a whole number in it has {len(digits)} digits; up to {_MAX_DIGITS} are read")
    return int(digits)
