"""Read the columns of a text table (CSV) as arrays. Begin at `read_csv_arrays`.

Encoding, delimiter, decimal sign, header and units are detected (`table_text`, `table_layout`). Empty fields are
missing samples. A column of numbers and words is an error, with line and column, only where it is used."""

import io
import re
from collections import Counter
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from study.importing.arrays.table_cells import MISSING, Line, has_number, is_comment, is_number, is_text, split_row
from study.importing.arrays.table_layout import TableLayout, find_layout
from study.importing.arrays.table_marks import NO_THOUSANDS, complete_rows_of_events
from study.importing.arrays.table_text import read_text
from study.importing.arrays.time_stamps import STAMP_NOTATIONS, is_stamp, join_stamps, read_stamps
from study.importing.map_format.import_map import CsvMap
from study.importing.map_format.signal_words import split_bracketed_unit

if TYPE_CHECKING:
    import pandas as pd

MAX_ROWS = 20_000_000
"""Most lines of a table that are read: more than five hours at 1 kHz. Chosen."""
MAX_COLUMNS = 10_000
"""Most columns of a table that are read. Chosen: a file with more is no recording, and would fill the memory."""
_MAX_LINE_CHARACTERS = 2**20
"""Longest line that is read, in characters: about a hundred for each of `MAX_COLUMNS` columns."""
_MAX_QUOTED_CHARACTERS = 60
"""Most characters of an invalid field that its message quotes. Chosen."""
_NUMBER_FIELD = re.compile(r'(?:^|[,;\t|])[\s"]*[-+.]?\d[\d.,:eE+-]*[\s"]*(?:[,;\t|]|$)')
"""Matches a line with a field that is a number, with any delimiter between its fields."""
_GROUPED_NUMBER = re.compile(r"[-+]?\d{1,3}([.,' \u00a0\u202f]\d{3})+([.,]\d*)?")
"""Matches a number that may have thousands separators, with which it is not read."""
_MISSING_FIELDS = [*MISSING, *(word.upper() for word in MISSING), "NaN", "None", "Null"]
"""Fields that stand for a missing sample."""


class FaultyColumn(str):
    """Problem of a column with words among its numbers, in place of its values; shown where the column is used."""


@dataclass(frozen=True, slots=True, eq=False)
class Table:
    """by_name: columns (n,), scalars (), or placeholders for columns that are not read. clocks: names of columns of
    dates or clock times, converted to seconds since the first. notes: sentences on conversions and omissions."""

    by_name: dict[str, npt.NDArray[Any]]
    clocks: tuple[str, ...]
    notes: tuple[str, ...]


def read_csv_arrays(path: Path, settings: CsvMap) -> Table:
    """Read the columns of a table file. Raises CannotReadError; ValueError with line and column of a problem."""
    source = read_text(path, settings.encoding)
    table = parse_lines(_split_lines(source.text, settings), settings)
    return replace(table, notes=(*table.notes, *filter(None, (source.note,))))


def parse_lines(lines: list[Line], settings: CsvMap) -> Table:
    """Read columns from the non-empty lines of a table. Raises ValueError with line and column of a problem."""
    lines = list(complete_rows_of_events(lines, settings))
    layout = find_layout(lines, settings)
    if not layout.body:
        raise ValueError("it has a header, but no rows below it")
    if len(layout.names) > MAX_COLUMNS:
        raise ValueError(f"it has {len(layout.names)} columns; up to {MAX_COLUMNS} are read")
    if repeated := sorted(name for name, count in Counter(layout.names).items() if count > 1):
        raise ValueError(f"its header names '{repeated[0]}' twice; give the columns names of their own in [csv] names")
    body = list(layout.body)
    _require_equal_rows(body, layout)
    comments = _describe_comments(lines, layout)
    body_text = "\n".join(line for _, line in body)
    text_names = {name for index, name in enumerate(layout.names) if index in layout.texts}
    first_fields = next((fields for _, line in body if all(fields := split_row(line, layout.delimiter))), [])
    stamp_names = {name for name, field in zip(layout.names, first_fields, strict=False) if is_stamp(field)}
    dtypes = {name: str if name in stamp_names | text_names else np.float64 for name in layout.names}
    try:
        frame = _read_frame(body_text, layout, {"dtype": dtypes, "na_values": _MISSING_FIELDS})
    except ValueError:
        frame = _read_frame(body_text, layout, {"dtype": str})  # slower, but it finds the invalid field
    if len(frame) != len(body):
        line_number = next((line_number for line_number, line in body if line.count('"') % 2), body[0][0])
        raise ValueError(f"line {line_number}: a quote is opened and not closed in its line; remove it, or close it")
    table = _classify_columns({name: frame[name] for name in layout.names if name not in text_names}, body, layout)
    faults = {name: problem for name in text_names if (problem := _find_fault(frame[name], name, body, layout))}
    faults |= {name: array.item() for name, array in table.by_name.items() if array.dtype.kind == "O"}
    notes = [f"Left out: '{name}' holds words, not numbers." for name in layout.names if name in text_names - {*faults}]
    notes += [f"Left out: {problem}." for problem in faults.values()]
    by_name = {**table.by_name, **{name: np.array(problem, dtype=object) for name, problem in faults.items()}}
    return Table(by_name, table.clocks, (*table.notes, *notes, *comments, *layout.notes))


def _classify_columns(columns: "Mapping[str, pd.Series[Any]]", body: list[Line], layout: TableLayout) -> Table:
    """Convert columns to numbers or seconds; leave out those of words only. A column with words among its numbers is
    replaced by its problem. Raises ValueError for a number in another notation, and as `read_stamps`."""
    arrays: dict[str, npt.NDArray[Any]] = {}
    stamps, text_names = {}, []
    for name, column in columns.items():
        if column.dtype == np.float64:
            arrays[name] = _reduce_to_scalar(column.to_numpy())
        elif (stamp_column := read_stamps(column.mask(_is_missing(column)))) is not None:
            stamps[name] = stamp_column
        elif all(map(is_text, column[~_is_missing(column)].str.strip())):
            text_names.append(name)
        else:
            try:
                arrays[name] = _reduce_to_scalar(_parse_numbers(column, name, body, layout))
            except ValueError as problem:
                if not all(is_number(field, layout.decimal) or is_text(field) for field in column.str.strip()):
                    raise  # a number in another notation is an error, not a remark
                arrays[name] = np.array(FaultyColumn(problem), dtype=object)
    joined_stamps = join_stamps(stamps)
    in_seconds = _name_in_seconds(joined_stamps, layout.names)
    all_columns = arrays | {name: _subtract_first(stamp.seconds) for name, stamp in joined_stamps.items()}
    notes = tuple(f"{name}: read as seconds since {stamp.first}." for name, stamp in joined_stamps.items())
    notes += tuple(f"Left out: '{name}' holds words, not numbers." for name in text_names)
    by_name = {in_seconds.get(name, name): all_columns[name] for name in columns if name in all_columns}
    return Table(by_name, tuple(in_seconds.values()), notes)


def _reduce_to_scalar(column: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
    """Reduce a column with a value in its first row only, such as a rate, to a scalar (); else return it (n,)."""
    is_single = len(column) > 1 and not np.isnan(column[0]) and bool(np.isnan(column[1:]).all())
    return np.asarray(column[0]) if is_single else column


def _name_in_seconds(names: Iterable[str], used_names: Iterable[str]) -> dict[str, str]:
    """Make the names of columns of stamps that were converted to seconds, by their names: the first of "t [s]",
    "t stamp [s]", "t stamp 2 [s]" and so on that is neither in `used_names` nor the name of another such column."""
    in_seconds: dict[str, str] = {}
    for name in names:
        taken_names, stem = {*used_names, *in_seconds.values()}, split_bracketed_unit(name)[0]
        marks = ("", " stamp", *(f" stamp {number}" for number in range(2, len(taken_names) + 2)))
        in_seconds[name] = next(new_name for mark in marks if (new_name := f"{stem}{mark} [s]") not in taken_names)
    return in_seconds


def _find_fault(column: "pd.Series[str]", name: str, body: list[Line], layout: TableLayout) -> FaultyColumn:
    """Find the first number in a column that was recognised as words: the problem, empty without a number."""
    is_number_field = column.fillna("").map(lambda field: has_number([field.strip()], layout.decimal)).to_numpy()
    if not is_number_field.any():
        return FaultyColumn()
    line_number = body[int(np.argmax(is_number_field))][0]
    return FaultyColumn(f"line {line_number}: column '{name}' holds words elsewhere; empty fields are missing samples")


def _is_missing(column: "pd.Series[str]") -> "pd.Series[bool]":
    """Whether each field (n,) stands for a missing sample."""
    return column.str.strip().str.lower().isin(MISSING)


def convert_times(stored: Mapping[str, npt.NDArray[Any]]) -> Table:
    """Convert arrays of dates and clock times to seconds since the first; keep others. Raises as `read_stamps`."""
    stamps = {name: pair for name, array in stored.items() if (pair := _convert_to_seconds(array)) is not None}
    in_seconds = _name_in_seconds(stamps, stored)
    converted = {in_seconds.get(name, name): stamps.get(name, (array, ""))[0] for name, array in stored.items()}
    notes = tuple(f"{name}: read as seconds since {first}." for name, (_, first) in stamps.items())
    return Table(converted, tuple(in_seconds.values()), notes)


def _convert_to_seconds(array: npt.NDArray[Any]) -> tuple[npt.NDArray[np.float64], str] | None:
    """Convert dates or times to seconds (n,) since the first; also return the first as text. None for other arrays."""
    values = np.ravel(array)
    if len(values) < 2 or len(values) != max(array.shape) or array.dtype.kind not in "MmSU":
        return None
    if array.dtype.kind in "Mm":
        first = values[int(np.argmin(np.isnat(values)))]
        return np.where(np.isnat(values), np.nan, (values - first) / np.timedelta64(1, "s")), str(first)
    if not is_stamp(str(values[0].decode("utf-8", "replace") if isinstance(values[0], bytes) else values[0]).strip()):
        return None
    import pandas as pd

    stamps = read_stamps(pd.Series(np.char.decode(values, "utf-8") if array.dtype.kind == "S" else values))
    if stamps is None:
        return None
    stamp_column = join_stamps({"": stamps})[""]
    return _subtract_first(stamp_column.seconds), stamp_column.first


def _subtract_first(seconds: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
    """Compute the seconds (n,) since the first stamp that is not missing; NaN stays NaN."""
    return np.asarray(seconds - seconds[int(np.argmax(np.isfinite(seconds)))])


def _split_lines(text: str, settings: CsvMap) -> list[Line]:
    """Number the lines from 1; leave out skipped and empty ones. Raises ValueError for too many or too long lines."""
    if max(text.count("\n"), text.count("\r")) > MAX_ROWS:
        raise ValueError(f"it has more than {MAX_ROWS} lines; save it as .npz or .h5")
    numbered_lines: list[Line] = []
    for number, line in enumerate(text.splitlines(), start=1):
        if len(line) > _MAX_LINE_CHARACTERS:
            raise ValueError(f"line {number} has {len(line)} characters; up to {_MAX_LINE_CHARACTERS} are read")
        if number > settings.skip_lines and line.strip():
            numbered_lines.append((number, line))
    return _join_header(numbered_lines)


def _join_header(lines: list[Line]) -> list[Line]:
    """Join header lines within a quoted name that contains a line break; lines from the first number on are kept."""
    first_index = next((index for index, (_, text) in enumerate(lines) if _NUMBER_FIELD.search(text)), 0)
    header: list[Line] = []
    for number, text in lines[:first_index]:
        if header and header[-1][1].count('"') % 2:
            header[-1] = (header[-1][0], f"{header[-1][1]} {text}")
        else:
            header.append((number, text))
    is_closed = not any(text.count('"') % 2 for _, text in header)
    return [*header, *lines[first_index:]] if is_closed and len(header) < first_index else lines


def _describe_comments(lines: list[Line], layout: TableLayout) -> tuple[str, ...]:
    """Describe comments below the first row in a remark. Raises ValueError for a comment with the fields of a row."""
    start, width = layout.body[0][0], len(layout.names)
    header_end = max((number for number, line in lines if number < start and not is_comment(line)), default=start)
    comments = [line for line in lines if line[0] > header_end and is_comment(line[1])]
    omitted = [line for line in comments if line[0] > start]
    for number, line in comments if layout.delimiter != " " else ():
        fields = split_row(line, layout.delimiter)
        is_data = any(fields[1:]) if number > start else has_number(fields[1:], layout.decimal)
        if len(fields) >= width > 1 and is_data:
            raise ValueError(
                f"line {number} begins with '{line.lstrip()[0]}' as a comment does, but has the fields of a row; "
                "correct it, or remove it"
            )
    count = f"{len(omitted)} comment line{'s' if len(omitted) > 1 else ''}"
    return (f"Left out: {count} below the first row (line {omitted[0][0]}).",) if omitted else ()


def _require_equal_rows(body: list[Line], layout: TableLayout) -> None:
    """Raise ValueError where a row has another number of fields than there are columns."""
    delimiter, column_count = layout.delimiter, len(layout.names)
    for line_number, line in body:
        if '"' in line:
            field_count = len(split_row(line, delimiter))
        else:
            field_count = len(line.split()) if delimiter == " " else line.count(delimiter) + 1
        if field_count != column_count:
            problem = f"line {line_number} has {field_count} fields, but there are {column_count} columns"
            raise ValueError(f"{problem}; {_suggest_remedy(line_number, line, body, delimiter)}")


def _suggest_remedy(line_number: int, line: str, body: list[Line], delimiter: str) -> str:
    """Suggest the remedy for a row with the wrong number of fields, by the likely cause."""
    if any(_GROUPED_NUMBER.fullmatch(field.strip(' "')) for field in re.split(r"[;\t|]", line)):
        return NO_THOUSANDS
    if delimiter in ", " and re.search(rf"(?<![\d.])[1-9]\d{{0,2}}{delimiter}\d{{3}}(?!\d)", line):
        return f"where '{delimiter}' separates thousands, {NO_THOUSANDS}; else remove that line, or complete it"
    if delimiter == " " and body[0][0] == line_number:
        return "where blanks separate fields, put names that contain blanks in quotes"
    if body[0][0] == line_number:
        return "where the line above is no header, state skip_lines and names under [csv] in the map"
    return "remove that line, or complete it"


def _read_frame(text: str, layout: TableLayout, options: dict[str, Any]) -> "pd.DataFrame":
    """Read the rows by pandas with further options. Raises ValueError where it cannot parse them."""
    import pandas as pd  # imported only here, because the import takes longer than reading a file of another format

    frame: pd.DataFrame = pd.read_csv(
        io.StringIO(text),
        sep=r"\s+" if layout.delimiter == " " else layout.delimiter,
        names=list(layout.names),
        decimal=layout.decimal,
        skipinitialspace=True,
        index_col=False,
        keep_default_na=False,
        **options,
    )
    return frame


def _parse_numbers(
    column: "pd.Series[str]", name: str, body: list[Line], layout: TableLayout
) -> npt.NDArray[np.float64]:
    """Parse a column of texts as numbers (n,), NaN where empty. Raises ValueError with line, field and remedy."""
    import pandas as pd

    fields, is_empty = column.str.strip(), _is_missing(column)
    if layout.decimal == ",":
        fields = fields.str.replace(".", "?", regex=False).str.replace(",", ".", regex=False)
    values = pd.to_numeric(fields.where(~is_empty), errors="coerce")
    is_unparsed = (values.isna() & ~is_empty).to_numpy()
    is_time = fields.map(is_stamp).to_numpy() & is_unparsed if is_unparsed.any() else is_unparsed
    invalid_rows = np.flatnonzero(is_unparsed & ~is_time if (is_unparsed & ~is_time).any() else is_unparsed)
    if len(invalid_rows):
        line_number, field = body[int(invalid_rows[0])][0], str(column.iloc[int(invalid_rows[0])])
        has_comma = layout.decimal == "." and re.fullmatch(r"[-+]?\d*,\d+([eE][-+]?\d+)?", field.strip())
        comma_hint = '; where the decimal sign is a comma, the map says decimal = "," under [csv]' if has_comma else ""
        stamp_hint = f"; {STAMP_NOTATIONS}" if re.search(r"\d[-/:]\d", field) else ""
        thousands = f"; {NO_THOUSANDS}" if _GROUPED_NUMBER.fullmatch(field.strip()) else ""
        remedy = comma_hint or stamp_hint or thousands or "; correct it, or leave it empty where the sample is missing"
        excerpt = field if len(field) <= _MAX_QUOTED_CHARACTERS else f"{field[:_MAX_QUOTED_CHARACTERS]}…"
        raise ValueError(f"line {line_number}, column '{name}': '{excerpt}' is not a number{remedy}")
    return np.asarray(values, dtype=np.float64)
