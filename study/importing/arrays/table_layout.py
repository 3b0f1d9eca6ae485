"""Where the parts of a table are: delimiter, decimal sign, header, row of units, and rows of numbers.

Seen from the numbers upwards, since they are what all tables have in common: the row above them is the header, or
units with the header above; what stands higher is remarks.
"""

import csv
import re
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

from equalizer.signals.units import UnknownUnitError, parse_unit, plain_unit
from study.importing.arrays.time_stamps import is_stamp
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
    begin = _first_numbers(rows, delimiter, decimal)
    if begin is None or settings.names:
        first = split_row(rows[0][1], delimiter)
        names = settings.names or tuple(_name_columns(first))
        if begin is None or any(_holds_number(split_row(text, delimiter), decimal) for _, text in rows[:begin]):
            begin = 0 if all(is_number(field, decimal) for field in first) else 1
        return TableLayout(delimiter, decimal, names, rows[begin:])
    fields = split_row(rows[begin][1], delimiter)
    width = len(fields)
    above = [_name_date(row, fields) for row in _rows_above(lines, rows, begin, delimiter)]
    header, units = _header_and_units(above, width, decimal)
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
    """Or dates and clock times beside a number."""
    plain = [field for field in fields if not is_stamp(field)]
    return all(is_number(field, decimal) for field in plain) and any(field.lower() not in EMPTY for field in plain)


def _first_numbers(rows: Sequence[Line], delimiter: str, decimal: str) -> int | None:
    """Index of the first row of numbers, or of the first of the rows directly above it that miss every number."""
    split = (split_row(text, delimiter) for _, text in rows)
    begin, width = next(((k, len(row)) for k, row in enumerate(split) if _all_numbers(row, decimal)), (None, 0))
    while begin:
        above = split_row(rows[begin - 1][1], delimiter)
        if len(above) != width or any(field.lower() not in EMPTY and not is_stamp(field) for field in above):
            break
        begin -= 1
    return begin


def _marks(rows: Sequence[Line], settings: CsvMap) -> tuple[str, str]:
    """Delimiter and decimal sign by which there are as many columns as the map names; or by which most rows are
    numbers: of several, those that split the line above them alike, then those with the most columns. Where none do,
    what splits the first row most often. Raises ValueError where a comma may be either sign."""
    sample = rows[:: max(len(rows) // _SAMPLED, 1)]
    best, found = (False, 0, False, 0), None
    for decimal in (settings.decimal,) if settings.decimal else (".", ","):
        for delimiter in (settings.delimiter,) if settings.delimiter else _DELIMITERS:
            if delimiter == decimal:
                continue
            read = [fields for _, text in sample if _all_numbers(fields := split_row(text, delimiter), decimal)]
            if not read:
                continue
            columns = Counter(map(len, read)).most_common(1)[0][0]
            begin = _first_numbers(rows, delimiter, decimal)
            header = rows[begin - 1][1] if begin else ""
            # A comma in the header speaks for commas that delimit: `t,u,` above `0,1` is no single decimal column.
            alike = len(split_row(header, delimiter)) == columns and not (decimal == "," and "," in header)
            rank = (columns == len(settings.names), len(read), alike, columns)
            if rank > best:
                best, found = rank, (delimiter, decimal)
    if found and found[1] == "," and not settings.decimal:
        _require_decimals(sample, found[0])
    return found or (settings.delimiter or _most_frequent(rows[0][1], settings.decimal), settings.decimal or ".")


def _require_decimals(sample: Sequence[Line], delimiter: str) -> None:
    """Raises ValueError where each comma in a number may as well separate thousands, as in 1,250 but not in 0,250."""
    read = [(number, split_row(text, delimiter)) for number, text in sample]
    with_comma = [(number, field) for number, row in read if _all_numbers(row, ",") for field in row if "," in field]
    if with_comma and all(re.fullmatch(r"[-+]?[1-9]\d{0,2},\d{3}", field) for _, field in with_comma):
        number, field = with_comma[0]
        raise ValueError(
            f"line {number}: the comma in '{field}' may separate thousands; where the decimal sign is a comma, "
            'the map says decimal = "," under [csv]'
        )


def _most_frequent(line: str, decimal: str) -> str:
    counts = {mark: line.count(mark) for mark in _DELIMITERS if mark not in (decimal, " ")}
    best = max(counts, key=lambda mark: counts[mark])
    return best if counts[best] else " "


def _strip_comment(line: str) -> str:
    return line.strip().lstrip("".join(COMMENTS)).strip() if is_comment(line) else line


def _rows_above(lines: Sequence[Line], rows: Sequence[Line], begin: int, delimiter: str) -> list[list[str]]:
    """Those that are no comments, and below them a comment that holds units; comments where there is nothing else."""
    plain = [split_row(text, delimiter) for _, text in rows[:begin]]
    last = rows[begin - 1][0] if begin else 0
    between = [text for number, text in lines if last < number < rows[begin][0]]
    comments = [fields for text in between if (fields := split_row(_strip_comment(text), delimiter))]
    if not plain:
        return comments
    return plain + [fields for fields in comments if len(fields) == len(plain[-1]) and _are_units(fields)][-1:]


def _name_date(header: list[str], fields: Sequence[str]) -> list[str]:
    """A header that has one name for a date and the clock time behind it, where blanks delimit, gets a second."""
    at = next((k for k, pair in enumerate(pairwise(fields)) if all(map(is_stamp, pair))), None)
    return header if at is None or len(header) != len(fields) - 1 else [*header[:at], "date", *header[at:]]


def _header_and_units(
    above: Sequence[list[str]], width: int, decimal: str
) -> tuple[list[str] | None, list[str] | None]:
    """The rows directly above the numbers; None where there is none of their width without a number in it."""
    words = [fields if len(fields) == width else None for fields in above]
    last = words[-1] if words else None
    before = words[-2] if len(words) > 1 else None
    if last and len(words) > 1 and _are_units(last):  # units below what is no header do not become the header
        return (before, last) if before and not _holds_number(before, decimal) else (None, None)
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
