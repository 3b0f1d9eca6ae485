"""Where the parts of a table are: delimiter, decimal sign, header, row of units, and rows of numbers.

Seen from the numbers upwards, since they are what all tables have in common: the row above them is the header, or
units with the header above; what stands higher is remarks.
"""

import csv
import re
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass

from equalizer.signals.units import UnknownUnitError, parse_unit, plain_unit
from study.importing.map_format.import_map import CsvMap
from study.importing.map_format.signal_words import name_signal

Line = tuple[int, str]
"""Number in the file, from 1, and text."""

EMPTY = ("", "nan", "na", "n/a", "null", "-", "none")
COMMENTS = ("#", "%")
_DELIMITERS = (",", ";", "\t", "|", " ")
_UNITLESS = (*EMPTY, "1")
_SAMPLED = 32
"""Rows that delimiter and decimal sign are tried on."""


@dataclass(frozen=True, slots=True)
class TableLayout:
    delimiter: str
    decimal: str
    names: tuple[str, ...]
    """With the unit in brackets where a row of units states it."""
    body: Sequence[Line]


def find_layout(lines: Sequence[Line], settings: CsvMap) -> TableLayout:
    """lines: not empty, those that are comments included. Raises ValueError with what contradicts."""
    rows = [line for line in lines if not is_comment(line[1])]
    if not rows:
        raise ValueError("it holds no lines")
    delimiter, decimal = _marks(rows, settings)
    begin = next((k for k, (_, text) in enumerate(rows) if _all_numbers(split_row(text, delimiter), decimal)), None)
    if begin is None or settings.names:
        first = split_row(rows[0][1], delimiter)
        has_header = not _all_numbers(first, decimal)
        names = settings.names or tuple(_name_columns(first))
        return TableLayout(delimiter, decimal, names, rows[1:] if has_header else rows)
    width = len(split_row(rows[begin][1], delimiter))
    above = [split_row(_strip_comment(text), delimiter) for number, text in lines if number < rows[begin][0]]
    header, units = _header_and_units([fields for fields in above if fields], width, decimal)
    if header is None:
        if begin == 0:
            return TableLayout(delimiter, decimal, tuple(f"column{k + 1}" for k in range(width)), rows)
        return TableLayout(delimiter, decimal, tuple(_name_columns(split_row(rows[0][1], delimiter))), rows[1:])
    return TableLayout(delimiter, decimal, tuple(_with_units(_name_columns(header), units)), rows[begin:])


def is_comment(line: str) -> bool:
    return line.lstrip().startswith(COMMENTS)


def split_row(line: str, delimiter: str) -> list[str]:
    if not line:
        return []
    if delimiter == " " and '"' not in line:
        return re.split(r"\s+(?![\[(])", line.strip())  # `force [N]` is one field
    try:
        fields = next(csv.reader([line], delimiter=delimiter, skipinitialspace=True))
    except csv.Error:  # the reader takes no field above 131 072 letters, as a long line of another delimiter is
        fields = line.split(delimiter)
    return [field.strip() for field in fields]


def is_number(field: str, decimal: str) -> bool:
    """Or an empty field. With a decimal comma a point is none: it would separate thousands."""
    try:
        float(field.replace(".", " ").replace(",", ".") if decimal == "," else field)
    except ValueError:
        return field.lower() in EMPTY
    return True


def _all_numbers(fields: Sequence[str], decimal: str) -> bool:
    return all(is_number(field, decimal) for field in fields) and any(field.lower() not in EMPTY for field in fields)


def _marks(rows: Sequence[Line], settings: CsvMap) -> tuple[str, str]:
    """Delimiter and decimal sign by which most rows are numbers: of several, those that split the header alike, then
    those with the most columns. Where none do, what splits the first row most often."""
    sample = [text for _, text in rows[:: max(len(rows) // _SAMPLED, 1)]]
    header = next((text for _, text in rows if re.search("[A-Za-z]", text)), "")
    best, found = (0, False, 0), None
    for decimal in (settings.decimal,) if settings.decimal else (".", ","):
        for delimiter in (settings.delimiter,) if settings.delimiter else _DELIMITERS:
            if delimiter == decimal:
                continue
            read = [fields for text in sample if _all_numbers(fields := split_row(text, delimiter), decimal)]
            columns = Counter(map(len, read)).most_common(1)[0][0] if read else 0
            rank = (len(read), len(split_row(header, delimiter)) == columns, columns)
            if read and rank > best:
                best, found = rank, (delimiter, decimal)
    return found or (settings.delimiter or _most_frequent(rows[0][1], settings.decimal), settings.decimal or ".")


def _most_frequent(line: str, decimal: str) -> str:
    counts = {mark: line.count(mark) for mark in _DELIMITERS if mark not in (decimal, " ")}
    best = max(counts, key=lambda mark: counts[mark])
    return best if counts[best] else " "


def _strip_comment(line: str) -> str:
    return line.strip().lstrip("".join(COMMENTS)).strip() if is_comment(line) else line


def _header_and_units(
    above: Sequence[list[str]], width: int, decimal: str
) -> tuple[list[str] | None, list[str] | None]:
    """The rows directly above the numbers; None where there is none of their width without a number in it."""
    words = [fields if len(fields) == width else None for fields in above]
    last = words[-1] if words else None
    before = words[-2] if len(words) > 1 else None
    if last and before and _are_units(last) and not _holds_number(before, decimal):
        return before, last
    return (None if last is None or _holds_number(last, decimal) else last), None


def _holds_number(fields: Sequence[str], decimal: str) -> bool:
    return any(field.lower() not in EMPTY and is_number(field, decimal) for field in fields)


def _are_units(fields: Sequence[str]) -> bool:
    """Each a known unit, in brackets or not, or nothing; or all that say something in brackets."""
    said = [field for field in fields if field.lower() not in _UNITLESS]
    return bool(said) and (all(map(_is_unit, said)) or all(_bare(field) != field for field in said))


def _bare(field: str) -> str:
    match = re.fullmatch(r"[\[(]\s*(.*?)\s*[\])]", field)
    return match[1] if match else field


def _is_unit(field: str) -> bool:
    try:
        parse_unit(plain_unit(_bare(field)))
    except UnknownUnitError:
        return False
    return True


def _name_columns(header: Sequence[str]) -> list[str]:
    return [name or f"column{number}" for number, name in enumerate(header, start=1)]


def _with_units(header: Sequence[str], units: Sequence[str] | None) -> list[str]:
    """Names with their units in brackets. Raises ValueError where a name states another unit."""
    if units is None:
        return list(header)
    found = []
    for name, field in zip(header, units, strict=True):
        unit, said = plain_unit(_bare(field)), name_signal(name)
        if unit.lower() in _UNITLESS:
            found.append(name)
            continue
        if said.unit and said.sure and _is_unit(unit) and parse_unit(said.unit) != parse_unit(unit):
            raise ValueError(f"its header says {said.unit} in '{name}', and its row of units says {unit}")
        found.append(name if said.unit == unit else f"{name} [{unit}]")
    return found
