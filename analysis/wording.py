"""Formatting of numbers, p-values, lists and sentences for reports, tables and messages.

All text for people is formatted here, so that it looks the same everywhere: a true minus sign (U+2212), a fixed number
of decimals, and an en dash for a missing number.
"""

import re
from collections.abc import Sequence

_UNTIMED = (
    (r"√Hz", "√(cycle per sample)"),
    (r"\bHz\b", "cycles per sample"),
    (r"\(s\)", "(samples)"),
    (r"(?<=\d) s\b", " samples"),
)
"""Units that depend on time, and their replacements where samples are numbered and the rate of 1 Hz is nominal."""

NONE = "–"
"""Text for a missing number (en dash)."""
_NAMED = 12
"""Largest number of items that a sentence lists."""


def typeset(formatted: str) -> str:
    """A formatted number as people read it: with the minus sign (U+2212), and a zero without one.

    Every number for people that can be negative goes through here. Files for programs, and what may be copied into a
    command, keep the ASCII "-".
    """
    return formatted.replace("-", "−") if float(formatted) else formatted.replace("-", "")


def number(value: float | None, digits: int = 2) -> str:
    """A number with `digits` decimals and a true minus sign; a dash for None."""
    return NONE if value is None else typeset(f"{value:.{digits}f}")


def format_signed(value: float, digits: int = 2) -> str:
    """The number with its sign, also where it is positive."""
    return typeset(f"{value:+.{digits}f}")


def mark_cut(value: float | None, cut: bool, digits: int = 2) -> str:
    """The value, followed by "cut" where the largest permitted level (cap) limited it; a dash for None."""
    return f"{number(value, digits)} cut" if cut and value is not None else number(value, digits)


def count(value: int | None) -> str:
    """An integer as text; a dash for None."""
    return NONE if value is None else str(value)


def p_value(p: float | None) -> str:
    """A p-value with four decimals, or "< 0.0001"; a dash for None."""
    if p is None:
        return NONE
    return "< 0.0001" if p < 0.0001 else f"{p:.4f}"


def p_text(p: float | None) -> str:
    """A p-value for a sentence, such as "p = 0.0312" or "p < 0.0001"."""
    text = p_value(p)
    return f"p {text}" if text.startswith("<") else f"p = {text}"


def f_text(df_first: int | None, df_second: int | None, f: float | None) -> str:
    """An F statistic with its degrees of freedom, such as "F(4, 45) = 3.20"."""
    return f"F({count(df_first)}, {count(df_second)}) = {number(f)}"


def conjoin(things: Sequence[str]) -> str:
    """The items as a list in words, "a, b and c"; of more than 12, the first 12 "and n more"."""
    if len(things) > _NAMED:
        return f"{', '.join(things[:_NAMED])} and {len(things) - _NAMED} more"
    return " and ".join((", ".join(things[:-1]), things[-1])) if len(things) > 1 else "".join(things)


def capitalise(sentence: str) -> str:
    """The sentence with its first character in upper case and all others unchanged, unlike `str.capitalize`."""
    return sentence[:1].upper() + sentence[1:]


def as_sentence(text: str) -> str:
    """The text with a capital first letter and exactly one full stop at the end."""
    return f"{capitalise(text).rstrip('.')}."


def begin_sentence(sentence: str) -> str:
    """The sentence with a capital first letter, unless its first word has a mark of a file or identifier (. / \\ _)."""
    named = any(mark in sentence.partition(" ")[0] for mark in "./\\_")
    return sentence if named else capitalise(sentence)


def end_sentence(sentence: str) -> str:
    """The sentence with a full stop added, unless it ends with . ! or ?, or is empty."""
    return sentence if sentence.endswith((".", "!", "?")) or not sentence else f"{sentence}."


def write_without_time(text: str) -> str:
    """A sentence or label of a recording whose sample rate is unknown, in samples instead of seconds and hertz."""
    for unit, instead in _UNTIMED:
        text = re.sub(unit, instead, text)
    return text
