"""Detect the layout of a table: delimiter, decimal sign, header, row of units, and rows of numbers.

The rows of numbers are found first, because every table has them. The row above them is the header, or a row of units
with the header above it; rows further up are remarks.
"""

import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise, takewhile

from equalizer.signals.units import parse_unit, plain_unit
from study.importing.arrays.table_cells import (
    COMMENTS,
    EMPTY,
    Line,
    count_filled_fields,
    first_numbers,
    holds_data,
    holds_number,
    is_comment,
    is_number,
    is_text,
    is_unit,
    split_row,
)
from study.importing.arrays.table_marks import TableMarks, find_marks
from study.importing.arrays.time_stamps import is_stamp
from study.importing.map_format.import_map import CsvMap
from study.importing.map_format.signal_words import is_peak_value, name_signal

_UNITLESS = (*EMPTY, "1")
"""Entries of a row of units that state none."""
_BRACKETED = re.compile(r"(?<![^\[\]()])[^\[\]()]+[\[(][^\[\]()]*[\])]")
"""A name with its unit in brackets. The match begins at the start of the text or at a bracket; otherwise a search would
take quadratic time."""


@dataclass(frozen=True, slots=True)
class TableLayout:
    """How a text table is read: delimiter, decimal sign, names of the columns, and the rows of data."""

    delimiter: str
    decimal: str
    names: tuple[str, ...]
    """Column names, with the unit in brackets where a row of units states it."""
    body: Sequence[Line]
    texts: frozenset[int] = frozenset()
    """Indices of the columns of words."""
    notes: tuple[str, ...] = ()


def find_layout(lines: Sequence[Line], settings: CsvMap) -> TableLayout:
    """Layout from the lines that are not empty, comments included: marks, first row of numbers, remarks below the rows,
    empty fields at the ends of rows, then header and units. Rows between header and numbers that are data with an
    invalid field count as data. Raises ValueError for contradictions."""
    rows = [line for line in lines if not is_comment(line[1])]
    if not rows:
        raise ValueError("it holds no lines")
    marks = find_marks(rows, settings)
    begin = first_numbers(rows, marks.delimiter, marks.decimal, marks.texts)
    if begin is None:
        return _with_given_names(rows, begin, marks, settings)
    whole, notes = _without_remarks_below(rows, begin, marks)
    above = _rows_above(lines, whole, begin, marks.delimiter)
    faulty = _count_faulty(whole[:begin], len(split_row(whole[begin][1], marks.delimiter)), marks)
    least = max([len(settings.names), *map(count_filled_fields, above[: len(above) - faulty][-2:])])
    rows = [*whole[: begin - faulty], *_without_empty_ends(whole[begin - faulty :], marks.delimiter, least)]
    if settings.names:
        return replace(_with_given_names(rows, begin, marks, settings), notes=notes)
    fields = split_row(rows[begin][1], marks.delimiter)
    width = len(fields)
    named = [_fit_header(row, fields, marks.delimiter) for row in above]
    header, units = _header_and_units(named, width, marks.decimal)
    if header is None and faulty:
        header, units = _header_and_units(named[:-faulty], width, marks.decimal)
        begin -= 0 if header is None else faulty
    if header is not None:
        names = with_units(_name_columns(header), units)
    elif begin == 0 or (len(above[-1]) == 1 < width and all(len(row) != width for row in above)):  # remarks
        names = [f"column{k + 1}" for k in range(width)]
    else:
        begin = _first_header(rows[:begin], width, marks) + 1
        names = _name_columns(split_row(rows[begin - 1][1], marks.delimiter))
    return TableLayout(marks.delimiter, marks.decimal, tuple(names), rows[begin:], marks.texts, notes)


def _with_given_names(rows: Sequence[Line], begin: int | None, marks: TableMarks, settings: CsvMap) -> TableLayout:
    """Layout of a table whose map names its columns, or that has no row of numbers. In the latter case the header is
    the first row as wide as the last."""
    width = len(split_row(rows[-1][1], marks.delimiter))
    wide = [place for place, (_, text) in enumerate(rows) if len(split_row(text, marks.delimiter)) == width]
    rows = rows[0 if settings.names else wide[0] :]
    first = split_row(rows[0][1], marks.delimiter)
    names = settings.names or tuple(_name_columns(first))
    if begin is None or any(holds_number(split_row(text, marks.delimiter), marks.decimal) for _, text in rows[:begin]):
        begin = 0 if all(is_number(field, marks.decimal) for field in first) else 1
    return TableLayout(marks.delimiter, marks.decimal, names, rows[begin:], marks.texts)


def _without_empty_ends(body: Sequence[Line], delimiter: str, least: int) -> Sequence[Line]:
    """The rows without the delimiters with which every row ends, as long as at least `least` columns remain."""
    if delimiter == " ":
        return body
    surplus = len(split_row(body[0][1], delimiter)) - max(least, 1)
    blanks = f" \t{delimiter}"
    for _, text in body:
        if surplus < 1:
            return body
        surplus = min(surplus, text.count(delimiter, len(text.rstrip(blanks))))
    return [(number, text.rsplit(delimiter, surplus)[0]) for number, text in body]


def _without_remarks_below(
    rows: Sequence[Line], begin: int, marks: TableMarks
) -> tuple[Sequence[Line], tuple[str, ...]]:
    """The rows without lines of words below the last row, such as `End of file`; and a sentence about each of these
    lines."""
    width, end = len(split_row(rows[begin][1], marks.delimiter)), len(rows)
    while end > begin + 1:
        fields = [field for field in split_row(rows[end - 1][1], marks.delimiter) if field]
        if len(fields) == width or not all(map(is_text, fields)):
            break
        end -= 1
    return rows[:end], tuple(f"Left out: line {number}, '{text.strip()[:60]}'." for number, text in rows[end:])


def _count_faulty(above: Sequence[Line], width: int, marks: TableMarks) -> int:
    """Number of rows directly above the first row of numbers that are data with an invalid cell."""
    rows = (split_row(text, marks.delimiter) for _, text in reversed(above))
    return sum(1 for _ in takewhile(lambda fields: len(fields) == width and holds_data(fields, marks.decimal), rows))


def _strip_comment(line: str) -> str:
    """The line without its comment mark."""
    return line.strip().lstrip("".join(COMMENTS)).strip() if is_comment(line) else line


def _rows_above(lines: Sequence[Line], rows: Sequence[Line], begin: int, delimiter: str) -> list[list[str]]:
    """Fields of the header lines: lines that are not comments, and a comment below them that states units; comments if
    there are no others. A line whose first field is only a comment mark, with as many fields as columns, is a header
    too: the mark is a name."""
    narrow = len(split_row(_without_empty_ends(rows[begin:], delimiter, 1)[0][1], delimiter))
    widths = range(narrow, len(split_row(rows[begin][1], delimiter)) + 1)
    plain = [
        fields
        for number, text in lines
        if number < rows[begin][0]
        if (fields := split_row(text, delimiter))
        and (not is_comment(text) or _is_marked_header(fields, widths, delimiter))
    ]
    last = rows[begin - 1][0] if begin else 0
    between = [text for number, text in lines if last < number < rows[begin][0]]
    comments = [fields for text in between if (fields := split_row(_strip_comment(text), delimiter))]
    if not plain:
        return comments
    return plain + [fields for fields in comments if len(fields) == len(plain[-1]) and _are_units(fields)][-1:]


def _is_marked_header(fields: list[str], widths: range, delimiter: str) -> bool:
    """Whether the first field of a line is only a comment mark, and the line is as wide as a row."""
    return delimiter != " " and len(fields) in widths and fields[0] in COMMENTS and not any(map(is_comment, fields[1:]))


def _first_header(above: Sequence[Line], width: int, marks: TableMarks) -> int:
    """Index of the first row above the numbers with the same width, without a number and not of units; otherwise 0."""
    split = [split_row(text, marks.delimiter) for _, text in above]
    words = [len(row) == width and not holds_number(row, marks.decimal) and not _are_units(row) for row in split]
    return words.index(True) if True in words else 0


def _fit_header(header: list[str], fields: Sequence[str], delimiter: str) -> list[str]:
    """A header row with as many fields as a row of numbers, where it can be converted: without empty fields at its end;
    with names that contain the delimiter joined again, if each ends with its unit in brackets; or with a name added for
    a date next to a clock time. Otherwise the row as it is."""
    width = len(fields)
    if len(header) > width and not any(header[width:]):
        return header[:width]
    if len(header) > width == len(bracketed := _BRACKETED.findall(f"{delimiter} ".join(header))):
        return [" ".join(name.strip(f" {delimiter}").split()) for name in bracketed]
    at = next((k for k, pair in enumerate(pairwise(fields)) if all(map(is_stamp, pair))), None)
    return header if at is None or len(header) != width - 1 else [*header[:at], "date", *header[at:]]


def _header_and_units(
    above: Sequence[list[str]], width: int, decimal: str
) -> tuple[list[str] | None, list[str] | None]:
    """Header and row of units from the rows directly above the numbers. The header is None without a row of the right
    width that holds no data; the units are None without a row of units."""
    words = [fields if len(fields) == width else None for fields in above]
    last = words[-1] if words else None
    before = words[-2] if len(words) > 1 else None
    if last and len(words) > 1 and _are_units(last):  # a row of units is not the header
        return (before, last) if before and not holds_data(before, decimal) else (None, None)
    return (None if last is None or holds_data(last, decimal) else last), None


def _are_units(fields: Sequence[str]) -> bool:
    """Whether each field is a known unit, in brackets or not, or empty; or whether all texts are in brackets."""
    stated = [field for field in fields if field.lower() not in _UNITLESS]
    return bool(stated) and (
        all(is_unit(_strip_quotes(field)) for field in stated) or all(_strip_quotes(field) != field for field in stated)
    )


def _strip_quotes(field: str) -> str:
    """Text of a field without the brackets around it."""
    match = re.fullmatch(r"[\[(]\s*(.*?)\s*[\])]", field)
    return match[1] if match else field


def _name_columns(header: Sequence[str]) -> list[str]:
    """Names of the columns; `column3` where the third has none."""
    return [name or f"column{number}" for number, name in enumerate(header, start=1)]


def with_units(header: Sequence[str], units: Sequence[str] | None) -> list[str]:
    """Names with their units in brackets. Raises ValueError where a name states another unit."""
    if units is None:
        return list(header)
    found = []
    for name, field in zip(header, units, strict=True):
        stated, parsed = _strip_quotes(field), name_signal(name)
        unit = plain_unit(stated)
        if unit.lower() in _UNITLESS:
            found.append(name)
            continue
        if parsed.unit and parsed.sure and is_unit(unit) and parse_unit(parsed.unit) != parse_unit(unit):
            raise ValueError(f"its header says {parsed.unit} in '{name}', and its row of units says {unit}")
        found.append(name if parsed.unit == unit else f"{name} [{stated if is_peak_value(stated) else unit}]")
    return found
