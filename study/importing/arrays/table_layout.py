"""Detect the layout of a table: delimiter, decimal sign, header, row of units, and rows of numbers.

The rows of numbers are found first, because nearly every table has them. The row above them is the header, or a row of
units with the header above it; rows further up are remarks.
"""

import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise, takewhile

from equalizer.signals.units import normalise_unit, parse_unit
from study.importing.arrays.table_cells import (
    COMMENT_MARKS,
    MISSING,
    Line,
    count_filled_fields,
    find_first_number_row,
    has_data,
    has_number,
    is_comment,
    is_number,
    is_text,
    is_unit,
    split_row,
)
from study.importing.arrays.table_marks import TableMarks, find_marks
from study.importing.arrays.time_stamps import is_stamp
from study.importing.map_format.import_map import CsvMap
from study.importing.map_format.signal_words import is_peak_value, parse_signal_name

_UNITLESS = (*MISSING, "1")
"""Entries of a row of units that state none."""
_BRACKETED = re.compile(r"(?<![^\[\]()])[^\[\]()]+[\[(][^\[\]()]*[\])]")
"""A name with its unit in brackets. The match begins at the start of the text or at a bracket; otherwise a search would
take quadratic time."""


@dataclass(frozen=True, slots=True)
class TableLayout:
    """How a text table is read: delimiter, decimal sign, names of the columns, and the rows of data."""

    delimiter: str
    decimal: str
    """Decimal sign, "." or ","."""
    names: tuple[str, ...]
    """Column names, with the unit in brackets where a row of units states it."""
    body: Sequence[Line]
    """Rows of data, each with its number in the file."""
    texts: frozenset[int] = frozenset()
    """Indices of the columns of words."""
    notes: tuple[str, ...] = ()
    """Sentences about lines that were left out."""


def find_layout(lines: Sequence[Line], settings: CsvMap) -> TableLayout:
    """Find the layout of a table. lines: its lines that are not empty, comments included. In this order: delimiter and
    decimal sign, first row of numbers, remarks below the rows, empty fields at the ends of rows, header and units. Rows
    between header and numbers that are data with an invalid field count as data. Raises ValueError without a line, for
    an ambiguous comma or point, and where header and row of units contradict each other."""
    rows = [line for line in lines if not is_comment(line[1])]
    if not rows:
        raise ValueError("it holds no lines")
    marks = find_marks(rows, settings)
    first_row = find_first_number_row(rows, marks.delimiter, marks.decimal, marks.texts)
    if first_row is None:
        return _make_named_layout(rows, first_row, marks, settings)
    kept_rows, notes = _drop_trailing_remarks(rows, first_row, marks)
    header_fields = _collect_header_rows(lines, kept_rows, first_row, marks.delimiter)
    faulty_row_count = _count_faulty_rows(
        kept_rows[:first_row], len(split_row(kept_rows[first_row][1], marks.delimiter)), marks
    )
    min_columns = max(
        [len(settings.names), *map(count_filled_fields, header_fields[: len(header_fields) - faulty_row_count][-2:])]
    )
    rows = [
        *kept_rows[: first_row - faulty_row_count],
        *_strip_empty_ends(kept_rows[first_row - faulty_row_count :], marks.delimiter, min_columns),
    ]
    if settings.names:
        return replace(_make_named_layout(rows, first_row, marks, settings), notes=notes)
    fields = split_row(rows[first_row][1], marks.delimiter)
    column_count = len(fields)
    fitted_headers = [_fit_header(row, fields, marks.delimiter) for row in header_fields]
    header, units = _split_header_and_units(fitted_headers, column_count, marks.decimal)
    if header is None and faulty_row_count:
        header, units = _split_header_and_units(fitted_headers[:-faulty_row_count], column_count, marks.decimal)
        first_row -= 0 if header is None else faulty_row_count
    if header is not None:
        names = append_units(_name_columns(header), units)
    elif first_row == 0 or (
        len(header_fields[-1]) == 1 < column_count and all(len(row) != column_count for row in header_fields)
    ):  # remarks
        names = [f"column{k + 1}" for k in range(column_count)]
    else:
        first_row = _find_header_row(rows[:first_row], column_count, marks) + 1
        names = _name_columns(split_row(rows[first_row - 1][1], marks.delimiter))
    return TableLayout(marks.delimiter, marks.decimal, tuple(names), rows[first_row:], marks.texts, notes)


def _make_named_layout(rows: Sequence[Line], first_row: int | None, marks: TableMarks, settings: CsvMap) -> TableLayout:
    """Make the layout of a table whose map names its columns, or that has no row of numbers. Where the map names none,
    the header is the first row as wide as the last."""
    width = len(split_row(rows[-1][1], marks.delimiter))
    wide_rows = [index for index, (_, text) in enumerate(rows) if len(split_row(text, marks.delimiter)) == width]
    rows = rows[0 if settings.names else wide_rows[0] :]
    first_fields = split_row(rows[0][1], marks.delimiter)
    names = settings.names or tuple(_name_columns(first_fields))
    if first_row is None or any(
        has_number(split_row(text, marks.delimiter), marks.decimal) for _, text in rows[:first_row]
    ):
        first_row = 0 if all(is_number(field, marks.decimal) for field in first_fields) else 1
    return TableLayout(marks.delimiter, marks.decimal, names, rows[first_row:], marks.texts)


def _strip_empty_ends(body: Sequence[Line], delimiter: str, min_columns: int) -> Sequence[Line]:
    """Strip the delimiters with which every row ends, as long as at least `min_columns` columns remain."""
    if delimiter == " ":
        return body
    surplus_delimiters = len(split_row(body[0][1], delimiter)) - max(min_columns, 1)
    stripped_characters = f" \t{delimiter}"
    for _, text in body:
        if surplus_delimiters < 1:
            return body
        surplus_delimiters = min(surplus_delimiters, text.count(delimiter, len(text.rstrip(stripped_characters))))
    return [(number, text.rsplit(delimiter, surplus_delimiters)[0]) for number, text in body]


def _drop_trailing_remarks(
    rows: Sequence[Line], first_row: int, marks: TableMarks
) -> tuple[Sequence[Line], tuple[str, ...]]:
    """Drop lines of words below the last row of numbers, such as `End of file`. Returns the remaining rows, and a
    sentence about each dropped line, with its first 60 characters (chosen)."""
    width, row_stop = len(split_row(rows[first_row][1], marks.delimiter)), len(rows)
    while row_stop > first_row + 1:
        fields = [field for field in split_row(rows[row_stop - 1][1], marks.delimiter) if field]
        if len(fields) == width or not all(map(is_text, fields)):
            break
        row_stop -= 1
    return rows[:row_stop], tuple(
        f"Left out: line {number}, '{text.strip()[:60]}'." for number, text in rows[row_stop:]
    )


def _count_faulty_rows(rows_above: Sequence[Line], width: int, marks: TableMarks) -> int:
    """Count the rows directly above the first row of numbers that are data with an invalid cell."""
    rows = (split_row(text, marks.delimiter) for _, text in reversed(rows_above))
    return sum(1 for _ in takewhile(lambda fields: len(fields) == width and has_data(fields, marks.decimal), rows))


def _strip_comment(line: str) -> str:
    """Strip the comment mark from the start of a line."""
    return line.strip().lstrip("".join(COMMENT_MARKS)).strip() if is_comment(line) else line


def _collect_header_rows(
    lines: Sequence[Line], rows: Sequence[Line], first_row: int, delimiter: str
) -> list[list[str]]:
    """Collect the fields of the header lines: lines that are not comments, and a comment below them that states units;
    comments if there are no others. A line whose first field is only a comment mark, with as many fields as columns, is
    a header too: the mark is a name."""
    min_width = len(split_row(_strip_empty_ends(rows[first_row:], delimiter, 1)[0][1], delimiter))
    widths = range(min_width, len(split_row(rows[first_row][1], delimiter)) + 1)
    header_fields = [
        fields
        for number, text in lines
        if number < rows[first_row][0]
        if (fields := split_row(text, delimiter))
        and (not is_comment(text) or _is_marked_header(fields, widths, delimiter))
    ]
    last_number = rows[first_row - 1][0] if first_row else 0
    comment_lines = [text for number, text in lines if last_number < number < rows[first_row][0]]
    comments = [fields for text in comment_lines if (fields := split_row(_strip_comment(text), delimiter))]
    if not header_fields:
        return comments
    return (
        header_fields
        + [fields for fields in comments if len(fields) == len(header_fields[-1]) and _are_units(fields)][-1:]
    )


def _is_marked_header(fields: list[str], widths: range, delimiter: str) -> bool:
    """Whether the first field of a line is only a comment mark, and the line is as wide as a row."""
    return (
        delimiter != " "
        and len(fields) in widths
        and fields[0] in COMMENT_MARKS
        and not any(map(is_comment, fields[1:]))
    )


def _find_header_row(rows_above: Sequence[Line], width: int, marks: TableMarks) -> int:
    """Find the index of the first row above the numbers with the same width, without a number and not of units; 0 where
    there is none."""
    split_rows = [split_row(text, marks.delimiter) for _, text in rows_above]
    header_mask = [
        len(row) == width and not has_number(row, marks.decimal) and not _are_units(row) for row in split_rows
    ]
    return header_mask.index(True) if True in header_mask else 0


def _fit_header(header: list[str], fields: Sequence[str], delimiter: str) -> list[str]:
    """Convert a header row to as many fields as a row of numbers, where possible: without empty fields at its end;
    with names that contain the delimiter joined again, if each ends with its unit in brackets; or with a name added for
    a date next to a clock time. Otherwise the row is returned unchanged."""
    width = len(fields)
    if len(header) > width and not any(header[width:]):
        return header[:width]
    if len(header) > width == len(bracketed := _BRACKETED.findall(f"{delimiter} ".join(header))):
        return [" ".join(name.strip(f" {delimiter}").split()) for name in bracketed]
    stamp_index = next((k for k, pair in enumerate(pairwise(fields)) if all(map(is_stamp, pair))), None)
    return (
        header
        if stamp_index is None or len(header) != width - 1
        else [*header[:stamp_index], "date", *header[stamp_index:]]
    )


def _split_header_and_units(
    rows_above: Sequence[list[str]], width: int, decimal: str
) -> tuple[list[str] | None, list[str] | None]:
    """Split the rows directly above the numbers into header and row of units. The header is None without a row of the
    right width that holds no data; the units are None without a row of units or without a header above it."""
    full_rows = [fields if len(fields) == width else None for fields in rows_above]
    last_row = full_rows[-1] if full_rows else None
    header = full_rows[-2] if len(full_rows) > 1 else None
    if last_row and len(full_rows) > 1 and _are_units(last_row):  # a row of units is not the header
        return (header, last_row) if header and not has_data(header, decimal) else (None, None)
    return (None if last_row is None or has_data(last_row, decimal) else last_row), None


def _are_units(fields: Sequence[str]) -> bool:
    """Whether the fields that are not in `_UNITLESS` are known units, in brackets or not, or are all in brackets; False
    without any."""
    unit_texts = [field for field in fields if field.lower() not in _UNITLESS]
    return bool(unit_texts) and (
        all(is_unit(_strip_brackets(field)) for field in unit_texts)
        or all(_strip_brackets(field) != field for field in unit_texts)
    )


def _strip_brackets(field: str) -> str:
    """Strip round or square brackets around the text of a field."""
    match = re.fullmatch(r"[\[(]\s*(.*?)\s*[\])]", field)
    return match[1] if match else field


def _name_columns(header: Sequence[str]) -> list[str]:
    """Name the columns by their header; `column3` where the third has none."""
    return [name or f"column{number}" for number, name in enumerate(header, start=1)]


def append_units(header: Sequence[str], units: Sequence[str] | None) -> list[str]:
    """Append to each name its unit in brackets, unless the name states it; units None: no row of units. Raises
    ValueError where a name states another unit."""
    if units is None:
        return list(header)
    names = []
    for name, field in zip(header, units, strict=True):
        unit_text, parsed_name = _strip_brackets(field), parse_signal_name(name)
        unit = normalise_unit(unit_text)
        if unit.lower() in _UNITLESS:
            names.append(name)
            continue
        if (
            parsed_name.unit
            and parsed_name.is_certain
            and is_unit(unit)
            and parse_unit(parsed_name.unit) != parse_unit(unit)
        ):
            raise ValueError(f"its header says {parsed_name.unit} in '{name}', and its row of units says {unit}")
        names.append(
            name if parsed_name.unit == unit else f"{name} [{unit_text if is_peak_value(unit_text) else unit}]"
        )
    return names
