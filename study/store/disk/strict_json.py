"""Strict JSON of ordinary size: what Python accepts beyond the standard would fail later elsewhere."""

import json
import math
from typing import Any

DEEPEST = 64
"""Deepest nesting of a document: deeper ones would overflow the parser's stack."""
_LONGEST_NUMBER = 40
"""Digits of a whole number: seeds may have 128 bits."""


def load_json(text: str | bytes, *, with_nan: bool = False) -> Any:
    """Parse JSON. with_nan: NaN is accepted for unknown numbers. Raises only ValueError, with a sentence fragment."""
    try:
        found = json.loads(
            text,
            parse_constant=None if with_nan else _refuse,
            parse_float=_finite,
            parse_int=_parse_whole,
            object_pairs_hook=_without_doubles,
        )
    except RecursionError:
        raise ValueError("it is nested too deeply") from None
    _check(found)
    return found


def _check(found: Any) -> None:
    waiting = [(found, 0)]
    while waiting:
        value, depth = waiting.pop()
        if depth > DEEPEST:
            raise ValueError(f"it is nested more than {DEEPEST} levels deep")
        if isinstance(value, dict):
            waiting += ((inner, depth + 1) for entry in value.items() for inner in entry)
        elif isinstance(value, list):
            waiting += ((inner, depth + 1) for inner in value)
        elif isinstance(value, str):
            try:
                value.encode()
            except UnicodeEncodeError:
                raise ValueError("a text in it has half of a character (a lone surrogate)") from None


def _without_doubles(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    found = dict(pairs)
    if len(found) < len(pairs):
        names = [name for name, _ in pairs]
        raise ValueError(f"a record in it has '{max(names, key=names.count)}' twice")
    return found


def _refuse(constant: str) -> None:
    raise ValueError(f"JSON has no {constant}; write null")


def _finite(digits: str) -> float:
    number = float(digits)
    if not math.isfinite(number):
        raise ValueError(f"the number {digits[:30]} is larger than any that is read")
    return number


def _parse_whole(digits: str) -> int:
    if len(digits) > _LONGEST_NUMBER + digits.startswith("-"):
        raise ValueError(f"a whole number in it has {len(digits)} digits; up to {_LONGEST_NUMBER} are read")
    return int(digits)
