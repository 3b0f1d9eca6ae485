"""Formatting of numbers, p-values, lists and sentences for reports, tables and messages.

Numbers have a true minus sign (U+2212) and a fixed number of decimals; an en dash stands for a missing number.
"""

import math
import re
from collections.abc import Sequence

_UNIT_REPLACEMENTS = (
    (r"√Hz", "√(cycle per sample)"),
    (r"\bHz\b", "cycles per sample"),
    (r"\(s\)", "(samples)"),
    (r"(?<=\d) s\b", " samples"),
)
"""Units that depend on time, and their replacements where samples are numbered and the rate of 1 Hz is nominal."""

MISSING = "–"
"""Text for a missing number (en dash)."""
_MAX_LISTED_ITEMS = 12
"""Largest number of items that a sentence lists. Chosen."""
_LEAST_SIZE = 1e-9
"""Absolute value up to which a number counts as 0 when its decimals are chosen: the rounding of a sum. Chosen."""


def typeset(formatted: str) -> str:
    """Replace the hyphen of a formatted number by the minus sign (U+2212), and remove it from a zero.

    To be applied to every number in text for users that can be negative. Files for programs, and text that may be
    copied into a command, keep the ASCII "-". Raises ValueError for text that is no number.
    """
    return formatted.replace("-", "−") if float(formatted) else formatted.replace("-", "")


def format_number(value: float | None, digits: int = 2) -> str:
    """Format a number with `digits` decimals and a true minus sign; a dash for None."""
    return MISSING if value is None else typeset(f"{value:.{digits}f}")


def format_signed(value: float, digits: int = 2) -> str:
    """Format a number with `digits` decimals and its sign, "+" where it is positive; zero has "+" or no sign."""
    return typeset(f"{value:+.{digits}f}")


def choose_decimals(*values: float | None, least: int = 2, significant: int = 2) -> int:
    """Choose the number of decimals for values that are read together: `least`, or more where the largest of them would
    otherwise have fewer than `significant` significant digits."""
    largest = max((abs(value) for value in values if value is not None and math.isfinite(value)), default=0.0)
    return max(least, significant - 1 - math.floor(math.log10(largest))) if largest > _LEAST_SIZE else least


def format_newtons(value: float | None, least: int = 2) -> str:
    """Format a force in N, without its unit, with `least` decimals, below 0.1 N with two significant digits at least; a
    dash for None."""
    return format_number(value, choose_decimals(value, least=least))


def mark_cut(value: float | None, is_cut: bool) -> str:
    """Format a threshold in N, followed by "cut" where the largest permitted level (cap) limited it, so that it is
    censored; a dash for None."""
    return f"{format_newtons(value)} cut" if is_cut and value is not None else format_newtons(value)


def format_count(value: int | None) -> str:
    """Format an integer; a dash for None."""
    return MISSING if value is None else str(value)


def format_p(p: float | None) -> str:
    """Format a p-value with four decimals, or "< 0.0001"; a dash for None."""
    if p is None:
        return MISSING
    return "< 0.0001" if p < 0.0001 else f"{p:.4f}"


def format_p_text(p: float | None) -> str:
    """Format a p-value for a sentence, such as "p = 0.0312" or "p < 0.0001"."""
    text = format_p(p)
    return f"p {text}" if text.startswith("<") else f"p = {text}"


def format_f_text(df_first: int | None, df_second: int | None, f: float | None) -> str:
    """Format an F statistic with its degrees of freedom, such as "F(4, 45) = 3.20"."""
    return f"F({format_count(df_first)}, {format_count(df_second)}) = {format_number(f)}"


def conjoin(items: Sequence[str]) -> str:
    """Join the items to a list in words, "a, b and c"; of more than 12, the first 12 "and n more"."""
    if len(items) > _MAX_LISTED_ITEMS:
        return f"{', '.join(items[:_MAX_LISTED_ITEMS])} and {len(items) - _MAX_LISTED_ITEMS} more"
    return " and ".join((", ".join(items[:-1]), items[-1])) if len(items) > 1 else "".join(items)


def capitalise(sentence: str) -> str:
    """Convert the first character to upper case; the others stay unchanged, unlike by `str.capitalize`."""
    return sentence[:1].upper() + sentence[1:]


def format_sentence(text: str) -> str:
    """Capitalise the first letter, and end the text with exactly one full stop."""
    return f"{capitalise(text).rstrip('.')}."


def begin_sentence(sentence: str) -> str:
    """Capitalise the sentence, unless its first word is a file name or an identifier, as shown by one of . / \\ _."""
    is_identifier = any(mark in sentence.partition(" ")[0] for mark in "./\\_")
    return sentence if is_identifier else capitalise(sentence)


def end_sentence(sentence: str) -> str:
    """Add a full stop to the sentence, unless it ends with . ! or ?, or is empty."""
    return sentence if sentence.endswith((".", "!", "?")) or not sentence else f"{sentence}."


def replace_time_units(text: str) -> str:
    """Replace seconds and hertz by samples in a sentence or label of a recording whose sample rate is unknown."""
    for unit, replacement in _UNIT_REPLACEMENTS:
        text = re.sub(unit, replacement, text)
    return text
