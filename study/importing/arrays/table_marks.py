"""Detect delimiter, decimal sign and columns of words of a table: the choice by which most rows consist of numbers."""

import re
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from study.importing.arrays.table_cells import (
    Line,
    are_numbers,
    count_filled_fields,
    find_first_number_row,
    has_number,
    is_comment,
    is_empty,
    is_text,
    split_row,
)
from study.importing.map_format.import_map import CsvMap
from study.importing.map_format.signal_words import parse_signal_name

_DELIMITERS = (",", ";", "\t", "|", " ")
"""Delimiters that are tried, in this order."""
_SAMPLE_ROWS = 32
"""Approximate number of rows on which delimiters and decimal signs are tried, spread over the table. Chosen."""
_POINT_THOUSANDS = re.compile(r"[-+]?[1-9]\d{0,2}(\.\d{3})+")
"""A number whose points may separate thousands."""
NO_THOUSANDS = "write numbers without signs between thousands"
"""Advice in messages about such numbers."""


@dataclass(frozen=True, slots=True)
class TableMarks:
    """Delimiter, decimal sign and columns of words of a text table."""

    delimiter: str
    decimal: str
    """Decimal sign, "." or ","."""
    texts: frozenset[int] = frozenset()
    """Indices of the columns of words."""


def find_marks(rows: Sequence[Line], settings: CsvMap) -> TableMarks:
    """Find delimiter and decimal sign. Pairs are ranked by these criteria in turn: as many columns as the map names;
    most rows of numbers; tabs before blanks in a table with tabs; a line above the numbers that has as many fields;
    most columns. Columns of words are assumed where more rows consist of numbers with them. If no row consists of
    numbers, the delimiter of the map is taken, else that which splits most rows alike. Raises ValueError where a comma
    or point is ambiguous."""
    sample = rows[:: max(len(rows) // _SAMPLE_ROWS, 1)]
    has_tabs = all("\t" in text for _, text in sample[len(sample) // 2 :])
    best_rank, marks = (False, 0, False, False, 0), None
    for delimiter, decimal in _list_mark_pairs(sample, settings):
        number_rows = _select_number_rows(sample, TableMarks(delimiter, decimal))
        if not number_rows:
            continue
        column_count = Counter(map(len, number_rows)).most_common(1)[0][0]
        first_row = find_first_number_row(rows, delimiter, decimal)
        header = rows[first_row - 1][1] if first_row else ""
        header_fields = split_row(header, delimiter)
        has_fitting_fields = len(header_fields) == column_count or count_filled_fields(header_fields) == max(
            map(count_filled_fields, number_rows)
        )
        is_header = has_fitting_fields and not _has_delimiter_comma(header, decimal, column_count)
        rank = (
            column_count == len(settings.names),
            len(number_rows),
            not (has_tabs and delimiter == " "),
            is_header,
            column_count,
        )
        if rank > best_rank:
            best_rank, marks = rank, TableMarks(delimiter, decimal)
    marks_with_text_columns = _find_marks_with_text_columns(sample, settings)
    if marks_with_text_columns and len(_select_number_rows(sample, marks_with_text_columns)) > best_rank[1]:
        marks = marks_with_text_columns
    if marks and marks.decimal == "," and not settings.decimal:
        _refuse_ambiguous_commas(sample, marks)
    if marks and marks.decimal == "." and not settings.decimal:
        _refuse_ambiguous_points(rows, sample, marks)
    delimiter = settings.delimiter or _guess_delimiter(sample, settings.decimal)
    return marks or TableMarks(delimiter, settings.decimal or ".")


def complete_rows_of_events(rows: Sequence[Line], settings: CsvMap) -> Sequence[Line]:
    """Give all rows as many fields as the header where its last columns hold words, and most rows lack them, as loggers
    write events (`DAQ Pause`); other rows are unchanged. Only where `_find_width_with_events` shows which columns most
    rows lack. Of several events in a row (`DAQ Pause, DAQ Stop`), those beyond the header are left out."""
    for delimiter in (settings.delimiter,) if settings.delimiter else _DELIMITERS:
        if delimiter == " ":  # several may separate two fields, so that no missing field is seen
            continue
        widths = [1 + text.count(delimiter) for _, text in rows]
        width = Counter(widths[len(widths) // 2 :]).most_common(1)[0][0] if widths else 1
        if 1 < width < max(widths):
            header_width = _find_width_with_events(rows, width, delimiter)
            if header_width:
                return [(number, _fit_row(text, delimiter, width, header_width)) for number, text in rows]
    return rows


def _find_width_with_events(rows: Sequence[Line], width: int, delimiter: str) -> int:
    """Find the number of fields of the header, a line without numbers; 0 unless it and some rows of numbers have more
    than `width` fields, none of these rows fewer than the header, and all surplus fields are words. A row with fewer
    does not show which column its words belong to: a name may contain the delimiter (`force, N`)."""
    header_widths: set[int] = set()
    event_widths: set[int] = set()
    for _, text in rows:
        if text.count(delimiter) < width or is_comment(text):
            continue
        fields = split_row(text, delimiter)
        if not all(map(is_text, fields[width:])):
            return 0
        if len(fields) > width:
            is_data = any(has_number(fields[:width], decimal) for decimal in ".,")
            (event_widths if is_data else header_widths).add(len(fields))
    is_certain = len(header_widths) == 1 and bool(event_widths) and min(event_widths) >= max(header_widths)
    return header_widths.pop() if is_certain else 0


def _fit_row(text: str, delimiter: str, width: int, header_width: int) -> str:
    """Give a row of at least `width` fields `header_width` fields; comments, shorter rows and longer ones with quotes
    are unchanged."""
    field_count = len(split_row(text, delimiter))
    if field_count < width or is_comment(text):
        return text
    if field_count > header_width and '"' not in text:
        return delimiter.join(text.split(delimiter)[:header_width])
    return text + delimiter * (header_width - field_count)


def _select_number_rows(sample: Sequence[Line], marks: TableMarks) -> list[list[str]]:
    """Select the rows that consist of numbers, apart from columns of words; returns their fields."""
    split_rows = (split_row(text, marks.delimiter) for _, text in sample)
    return [fields for fields in split_rows if are_numbers(fields, marks.decimal, marks.texts)]


def _list_mark_pairs(sample: Sequence[Line], settings: CsvMap) -> Iterator[tuple[str, str]]:
    """List the possible pairs of delimiter and decimal sign. Both may be a comma where fields are quoted."""
    has_quotes = any('"' in text for _, text in sample)
    for decimal in (settings.decimal,) if settings.decimal else (".", ","):
        for delimiter in (settings.delimiter,) if settings.delimiter else _DELIMITERS:
            if delimiter != decimal or has_quotes:
                yield delimiter, decimal


def _has_delimiter_comma(header: str, decimal: str, column_count: int) -> bool:
    """Whether the line above rows with a decimal comma shows that commas are delimiters: a line with a comma (`t,u,`
    above `0,1`), or a remark of several words (`Rig 3`) above a single column."""
    if decimal != ",":
        return False
    parsed_name = parse_signal_name(header)
    is_remark = column_count == 1 and len(header.split()) > 1 and not parsed_name.unit and not parsed_name.quantity
    return ("," in header and '"' not in header) or is_remark


def _find_marks_with_text_columns(sample: Sequence[Line], settings: CsvMap) -> TableMarks | None:
    """Find the marks with the most columns of numbers, where other columns may hold words; None if no marks fit. Only
    the lower half of the rows is used, which is below any header; without lines of words of another width, which may
    stand below the rows."""
    max_number_columns, marks = 0, None
    for delimiter, decimal in _list_mark_pairs(sample, settings):
        lower_rows = [split_row(text, delimiter) for _, text in sample[len(sample) // 2 :]]
        width = Counter(map(len, lower_rows)).most_common(1)[0][0]
        rows = [row for row in lower_rows if len(row) == width or not all(map(is_text, filter(None, row)))]
        columns = list(zip(*rows, strict=True)) if len({len(row) for row in rows}) == 1 else []
        text_columns = frozenset(column for column, fields in enumerate(columns) if any(map(is_text, fields)))
        are_texts = all(is_text(field) or is_empty(field) for column in text_columns for field in columns[column])
        if are_texts and rows and all(are_numbers(row, decimal, text_columns) for row in rows):
            number_columns = sum(has_number(fields, decimal) for fields in columns)
            if number_columns > max_number_columns:
                max_number_columns, marks = number_columns, TableMarks(delimiter, decimal, text_columns)
    return marks


def _refuse_ambiguous_commas(sample: Sequence[Line], marks: TableMarks) -> None:
    """Raise ValueError where each comma in a number may separate thousands, as in 1,250 but not in 0,250."""
    numbered_rows = [(number, split_row(text, marks.delimiter)) for number, text in sample]
    comma_fields = [
        (number, field)
        for number, row in numbered_rows
        if are_numbers(row, ",", marks.texts)
        for column, field in enumerate(row)
        if "," in field and column not in marks.texts
    ]
    if comma_fields and all(re.fullmatch(r"[-+]?[1-9]\d{0,2},\d{3}", field) for _, field in comma_fields):
        number, field = comma_fields[0]
        raise ValueError(
            f"line {number}: the comma in '{field}' may separate thousands; where the decimal sign is a comma, "
            'the map says decimal = "," under [csv]'
        )


def _refuse_ambiguous_points(rows: Sequence[Line], sample: Sequence[Line], marks: TableMarks) -> None:
    """Raise ValueError where each point in a column may separate thousands, as in a column with 1.886 and 946."""
    columns = list(zip(*_select_number_rows(sample, marks), strict=False))
    for column in (column for column, fields in enumerate(columns) if _may_separate_thousands(fields)):
        all_fields = [fields[column] for fields in _select_number_rows(rows, marks) if len(fields) > column]
        if _may_separate_thousands(all_fields):
            example = next(field for field in all_fields if "." in field)
            raise ValueError(
                f"the point in '{example}' may separate thousands, for smaller numbers of its column have none; where "
                f'it is the decimal sign, the map says decimal = "." under [csv], else {NO_THOUSANDS}'
            )


def _may_separate_thousands(fields: Sequence[str]) -> bool:
    """Whether some numbers of a column have points that may separate thousands, and the others have at most three
    digits."""
    numbers = [field for field in fields if not is_empty(field)]
    point_fields = [field for field in numbers if "." in field]
    return (
        0 < len(point_fields) < len(numbers)
        and all(_POINT_THOUSANDS.fullmatch(field) for field in point_fields)
        and all(re.fullmatch(r"[-+]?\d{1,3}", field) for field in numbers if "." not in field)
    )


def _guess_delimiter(sample: Sequence[Line], decimal: str) -> str:
    """Guess the delimiter that splits most rows of the lower half into the same number of fields, for a precise error
    message."""
    lower_rows = [text for _, text in sample[len(sample) // 2 :]]

    def rank_delimiter(delimiter: str) -> tuple[int, int]:
        """Rank a delimiter by the number of rows with the most common number of fields, and that number; (0, 1) if rows
        are not split."""
        width, row_count = Counter(len(split_row(text, delimiter)) for text in lower_rows).most_common(1)[0]
        return (row_count, width) if width > 1 else (0, 1)

    return max((delimiter for delimiter in _DELIMITERS if delimiter != decimal), key=rank_delimiter)
