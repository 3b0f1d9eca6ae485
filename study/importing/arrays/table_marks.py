"""Detect delimiter, decimal sign and columns of words of a table: the choice by which most rows consist of numbers."""

import re
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from study.importing.arrays.table_cells import (
    Line,
    are_numbers,
    count_filled_fields,
    first_numbers,
    holds_number,
    is_empty,
    is_text,
    split_row,
)
from study.importing.map_format.import_map import CsvMap
from study.importing.map_format.signal_words import name_signal

_DELIMITERS = (",", ";", "\t", "|", " ")
"""Delimiters that are tried, in this order."""
_SAMPLED = 32
"""Approximate number of rows on which delimiters and decimal signs are tried, spread over the table."""
_POINTED = re.compile(r"[-+]?[1-9]\d{0,2}(\.\d{3})+")
"""A number whose points may separate thousands."""
NO_THOUSANDS = "write numbers without signs between thousands"
"""Advice in messages about such numbers."""


@dataclass(frozen=True, slots=True)
class TableMarks:
    """Delimiter and decimal sign of a text table."""

    delimiter: str
    decimal: str
    texts: frozenset[int] = frozenset()
    """Indices of the columns of words."""


def find_marks(rows: Sequence[Line], settings: CsvMap) -> TableMarks:
    """Find delimiter and decimal sign. Pairs are ranked in this order: as many columns as the map names; most rows of
    numbers; tabs before blanks in a table with tabs; a line above the numbers that has as many fields; most columns.
    Columns of words are assumed where more rows consist of numbers with them. If no row consists of numbers, the
    delimiter is taken that splits most rows alike. Raises ValueError where a comma or point is ambiguous."""
    sample = rows[:: max(len(rows) // _SAMPLED, 1)]
    tabbed = all("\t" in text for _, text in sample[len(sample) // 2 :])
    best, found = (False, 0, False, False, 0), None
    for delimiter, decimal in _pairs(sample, settings):
        read = _rows_of_numbers(sample, TableMarks(delimiter, decimal))
        if not read:
            continue
        columns = Counter(map(len, read)).most_common(1)[0][0]
        begin = first_numbers(rows, delimiter, decimal)
        header = rows[begin - 1][1] if begin else ""
        named = split_row(header, delimiter)
        fits = len(named) == columns or count_filled_fields(named) == max(map(count_filled_fields, read))
        alike = fits and not _is_no_name(header, decimal, columns)
        rank = (columns == len(settings.names), len(read), not (tabbed and delimiter == " "), alike, columns)
        if rank > best:
            best, found = rank, TableMarks(delimiter, decimal)
    beside = _beside_words(sample, settings)
    if beside and len(_rows_of_numbers(sample, beside)) > best[1]:
        found = beside
    if found and found.decimal == "," and not settings.decimal:
        _require_decimals(sample, found)
    if found and found.decimal == "." and not settings.decimal:
        _require_points(rows, sample, found)
    delimiter = settings.delimiter or _likely_delimiter(sample, settings.decimal)
    return found or TableMarks(delimiter, settings.decimal or ".")


def _rows_of_numbers(sample: Sequence[Line], marks: TableMarks) -> list[list[str]]:
    """Fields of the rows that consist of numbers, apart from columns of words."""
    split = (split_row(text, marks.delimiter) for _, text in sample)
    return [fields for fields in split if are_numbers(fields, marks.decimal, marks.texts)]


def _pairs(sample: Sequence[Line], settings: CsvMap) -> Iterator[tuple[str, str]]:
    """Possible pairs of delimiter and decimal sign. Both may be a comma where fields are quoted."""
    quoted = any('"' in text for _, text in sample)
    for decimal in (settings.decimal,) if settings.decimal else (".", ","):
        for delimiter in (settings.delimiter,) if settings.delimiter else _DELIMITERS:
            if delimiter != decimal or quoted:
                yield delimiter, decimal


def _is_no_name(header: str, decimal: str, columns: int) -> bool:
    """Whether the line above rows with a decimal comma shows that commas are delimiters: a line with a comma (`t,u,`
    above `0,1`), or a remark of several words (`Rig 3`) above a single column."""
    if decimal != ",":
        return False
    parsed = name_signal(header)
    remark = columns == 1 and len(header.split()) > 1 and not parsed.unit and not parsed.quantity
    return ("," in header and '"' not in header) or remark


def _beside_words(sample: Sequence[Line], settings: CsvMap) -> TableMarks | None:
    """The marks with the most columns of numbers where other columns hold words; None if there are none. Only the lower
    half of the rows is used, which is below any header."""
    best, found = 0, None
    for delimiter, decimal in _pairs(sample, settings):
        rows = [split_row(text, delimiter) for _, text in sample[len(sample) // 2 :]]
        columns = list(zip(*rows, strict=True)) if len({len(row) for row in rows}) == 1 else []
        texts = frozenset(place for place, fields in enumerate(columns) if any(map(is_text, fields)))
        words = all(is_text(field) or is_empty(field) for place in texts for field in columns[place])
        if words and rows and all(are_numbers(row, decimal, texts) for row in rows):
            numbers = sum(holds_number(fields, decimal) for fields in columns)
            if numbers > best:
                best, found = numbers, TableMarks(delimiter, decimal, texts)
    return found


def _require_decimals(sample: Sequence[Line], marks: TableMarks) -> None:
    """Raises ValueError where each comma in a number may separate thousands, as in 1,250 but not in 0,250."""
    read = [(number, split_row(text, marks.delimiter)) for number, text in sample]
    with_comma = [
        (number, field)
        for number, row in read
        if are_numbers(row, ",", marks.texts)
        for place, field in enumerate(row)
        if "," in field and place not in marks.texts
    ]
    if with_comma and all(re.fullmatch(r"[-+]?[1-9]\d{0,2},\d{3}", field) for _, field in with_comma):
        number, field = with_comma[0]
        raise ValueError(
            f"line {number}: the comma in '{field}' may separate thousands; where the decimal sign is a comma, "
            'the map says decimal = "," under [csv]'
        )


def _require_points(rows: Sequence[Line], sample: Sequence[Line], marks: TableMarks) -> None:
    """Raises ValueError where each point in a column may separate thousands, as in a column with 1.886 and 946."""
    columns = list(zip(*_rows_of_numbers(sample, marks), strict=False))
    for place in (place for place, fields in enumerate(columns) if _may_be_thousands(fields)):
        whole = [fields[place] for fields in _rows_of_numbers(rows, marks) if len(fields) > place]
        if _may_be_thousands(whole):
            shown = next(field for field in whole if "." in field)
            raise ValueError(
                f"the point in '{shown}' may separate thousands, for smaller numbers of its column have none; where "
                f'it is the decimal sign, the map says decimal = "." under [csv], else {NO_THOUSANDS}'
            )


def _may_be_thousands(fields: Sequence[str]) -> bool:
    """Whether some numbers of a column have points that may separate thousands, and the others have at most three
    digits."""
    numbers = [field for field in fields if not is_empty(field)]
    pointed = [field for field in numbers if "." in field]
    return (
        0 < len(pointed) < len(numbers)
        and all(_POINTED.fullmatch(field) for field in pointed)
        and all(re.fullmatch(r"[-+]?\d{1,3}", field) for field in numbers if "." not in field)
    )


def _likely_delimiter(sample: Sequence[Line], decimal: str) -> str:
    """The delimiter that splits most rows of the lower half into the same number of fields, for a precise error
    message."""
    lower = [text for _, text in sample[len(sample) // 2 :]]

    def alike(mark: str) -> tuple[int, int]:
        width, rows = Counter(len(split_row(text, mark)) for text in lower).most_common(1)[0]
        return (rows, width) if width > 1 else (0, 1)

    return max((mark for mark in _DELIMITERS if mark != decimal), key=alike)
