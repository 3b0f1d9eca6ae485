"""Fields of a text table: split a row into fields, and classify each as number, text, unit, time stamp or missing."""

import csv
import re
from collections.abc import Collection, Sequence

from equalizer.signals.units import UnknownUnitError, normalise_unit, parse_unit
from study.importing.arrays.time_stamps import is_stamp

Line = tuple[int, str]
"""A line with its number in the file, from 1."""

NOT_AVAILABLE = "#n/a"
"""Error value of spreadsheets for a missing number."""
MISSING = (
    "", "nan", "-nan", "na", "n/a", "n.a.", NOT_AVAILABLE, "null", "none", "-", "--", "---", "1.#qnan", "-1.#qnan",
    "1.#ind", "-1.#ind", "nan(ind)", "-nan(ind)",
)  # fmt: skip
"""Fields, in lower case, that stand for a missing number."""
COMMENT_MARKS = ("#", "%")
"""Marks with which a comment line begins."""
_SPREADSHEET_ERRORS = (NOT_AVAILABLE, "#div/0!", "#ref!", "#value!", "#name?", "#num!", "#null!")
"""Cells of a spreadsheet that look like the beginning of a comment but are not."""
_COMPARED_LENGTH = 8
"""Number of characters of a line that are compared with `_SPREADSHEET_ERRORS`, the longest of which has 7."""
_NUMBER_LIKE = re.compile(r"[-+]?[.,]?\d[\d.,:/' \u00a0\u202f-]*(?:[dDeE][-+]?\d+)?(?P<rest>.*)")
"""A field that begins like a number, date or clock time; `rest` is the text behind that."""
_BRACKETED = re.compile(r"[\[(].*[\])]")
"""A unit in brackets."""


def is_comment(line: str) -> bool:
    """Whether a line begins with # or %, and not with an error value of a spreadsheet, such as `#N/A`."""
    text = line.lstrip()
    return text.startswith(COMMENT_MARKS) and not text[:_COMPARED_LENGTH].lower().startswith(_SPREADSHEET_ERRORS)


def split_row(line: str, delimiter: str) -> list[str]:
    """Split a line into stripped fields; none for an empty line. With blanks as delimiters, a name and its unit in
    brackets (`force [N]`) are one field."""
    if not line:
        return []
    if delimiter == " " and '"' not in line:
        words = line.split()
        if all(is_empty(word) or _BRACKETED.fullmatch(word) for word in words):
            return words
        return re.split(r"\s+(?![\[(])", line.strip())  # `force [N]` is one field
    try:
        fields = next(csv.reader([line], delimiter=delimiter, skipinitialspace=True))
    except csv.Error:  # a field above 131 072 characters, such as a line with another delimiter
        fields = line.split(delimiter)
    return [field.strip() for field in fields]


def is_number(field: str, decimal: str) -> bool:
    """Whether a field is a number (also infinite) or stands for a missing one. decimal: decimal sign; with a comma, a
    field with a point is no number: the point may separate thousands."""
    if "_" in field:  # Python reads 1_000 as 1000, but in files it is a label
        return False
    try:
        float(field.replace(".", "?").replace(",", ".") if decimal == "," else field)
    except ValueError:
        return field.lower() in MISSING
    return True


def is_empty(field: str) -> bool:
    """Whether a field is empty or stands for a missing value, such as `nan` or `n/a`, in upper or lower case."""
    return field.lower() in MISSING


def count_filled_fields(fields: Sequence[str]) -> int:
    """Count the fields, without empty ones at the end."""
    return max((count for count, field in enumerate(fields, start=1) if field), default=0)


def is_text(field: str) -> bool:
    """Whether a field is words, or a digit with letters (`3a`). A number in an unknown notation (`1.234,5`, `12:30`, `3
    mm`), and several numbers in one field, are not words."""
    match = _NUMBER_LIKE.fullmatch(field)
    is_numeric = match is not None and (not re.fullmatch(r"\w+", match["rest"]) or is_unit(match["rest"]))
    return not is_numeric and not is_stamp(field) and not is_number(field, ".")


def is_unit(text: str) -> bool:
    """Whether a field is a unit in a known spelling."""
    try:
        parse_unit(normalise_unit(text))
    except UnknownUnitError:
        return False
    return True


def has_data(fields: Sequence[str], decimal: str) -> bool:
    """Whether any field is a number in any notation, a date or a clock time, none of which occurs in a header."""
    return has_number(fields, decimal) or any(is_stamp(field) or _is_number_in_any_notation(field) for field in fields)


def _is_number_in_any_notation(field: str) -> bool:
    """Whether a field is a number, date or clock time in any notation, without text behind it."""
    match = _NUMBER_LIKE.fullmatch(field)
    return match is not None and not match["rest"]


def are_numbers(fields: Sequence[str], decimal: str, text_columns: Collection[int] = ()) -> bool:
    """Whether a row consists of numbers, or of dates and clock times with at least one number.
    text_columns: indices of columns of words, which are ignored."""
    values = [field for column, field in enumerate(fields) if column not in text_columns and not is_stamp(field)]
    return all(is_number(field, decimal) for field in values) and not all(map(is_empty, values))


def has_number(fields: Sequence[str], decimal: str) -> bool:
    """Whether any field is a number; fields that stand for a missing value do not count."""
    return any(not is_empty(field) and is_number(field, decimal) for field in fields)


def find_first_number_row(
    rows: Sequence[Line], delimiter: str, decimal: str, text_columns: Collection[int] = ()
) -> int | None:
    """Find the index of the first row of numbers, or of the first of the rows directly above it that are as wide and in
    which every number is missing; None without a row of numbers. text_columns: as in `are_numbers`."""
    split_rows = (split_row(text, delimiter) for _, text in rows)
    first_index_and_width = next(
        ((row_index, len(row)) for row_index, row in enumerate(split_rows) if are_numbers(row, decimal, text_columns)),
        None,
    )
    index, width = first_index_and_width or (None, 0)
    while index:
        fields_above = split_row(rows[index - 1][1], delimiter)
        if len(fields_above) != width or not all(is_empty(field) or is_stamp(field) for field in fields_above):
            break
        index -= 1
    return index
