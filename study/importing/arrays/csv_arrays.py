"""Read the columns of a text table as arrays.

Encoding, delimiter, decimal sign, header and units are detected (`table_text`, `table_layout`). Empty fields are
missing samples. An invalid field is reported with its line and column, but only where its column is used.
"""

import io
import re
from collections import Counter
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from study.importing.arrays.table_cells import EMPTY, Line, holds_number, is_comment, is_number, is_text, split_row
from study.importing.arrays.table_layout import TableLayout, find_layout
from study.importing.arrays.table_marks import NO_THOUSANDS
from study.importing.arrays.table_text import read_text
from study.importing.arrays.time_stamps import STAMP_WORDS, is_stamp, join_stamps, read_stamps
from study.importing.map_format.import_map import CsvMap
from study.importing.map_format.signal_words import unit_in

if TYPE_CHECKING:
    import pandas as pd

MOST_ROWS = 20_000_000
"""Most rows of a table: more than five hours at 1 kHz."""
MOST_COLUMNS = 10_000
"""Most columns of a table: a file with more is no recording, and would fill the memory."""
_LONGEST_LINE = 2**20
"""Longest line, in characters: about a hundred for each of `MOST_COLUMNS` columns."""
_LONGEST_SHOWN = 60
"""Most characters of an invalid field that its message quotes."""
_HOLDS_NUMBER = re.compile(r'(?:^|[,;\t|])[\s"]*[-+.]?\d[\d.,:eE+-]*[\s"]*(?:[,;\t|]|$)')
"""Matches a line with a field that is a number, with any delimiter between its fields."""
_THOUSANDS = re.compile(r"[-+]?\d{1,3}([.,' \u00a0\u202f]\d{3})+([.,]\d*)?")
"""A number with thousands separators, which is not read."""
_MISSING = [*EMPTY, *(word.upper() for word in EMPTY), "NaN", "None", "Null"]
"""Fields that stand for a missing sample."""


class FaultyColumn(str):
    """Problem of a column with an invalid field, in place of its values: reported only where the column is used."""


@dataclass(frozen=True, slots=True, eq=False)
class Table:
    """by_name: columns. clocks: names of the columns that were dates or clock times, now in seconds since the first.
    notes: remarks."""

    by_name: dict[str, npt.NDArray[Any]]
    clocks: tuple[str, ...]
    notes: tuple[str, ...]


def read_csv_arrays(path: Path, settings: CsvMap) -> Table:
    """Read the columns of a table. Empty fields are missing samples. Raises CannotReadError; ValueError with line and
    column of a problem."""
    whole = read_text(path, settings.encoding)
    made = read_lines(_lines(whole.text, settings), settings)
    return replace(made, notes=(*made.notes, *filter(None, (whole.note,))))


def read_lines(lines: list[Line], settings: CsvMap) -> Table:
    """Columns from the lines of a table that are not empty. Raises ValueError with line and column of a problem."""
    layout = find_layout(lines, settings)
    if not layout.body:
        raise ValueError("it has a header, but no rows below it")
    if len(layout.names) > MOST_COLUMNS:
        raise ValueError(f"it has {len(layout.names)} columns; up to {MOST_COLUMNS} are read")
    if doubled := sorted(name for name, count in Counter(layout.names).items() if count > 1):
        raise ValueError(f"its header names '{doubled[0]}' twice; give the columns names of their own in [csv] names")
    body = list(layout.body)
    _require_equal_rows(body, layout)
    comments = _comments(lines, layout)
    text = "\n".join(line for _, line in body)
    words = {name for place, name in enumerate(layout.names) if place in layout.texts}
    first = next((fields for _, line in body if all(fields := split_row(line, layout.delimiter))), [])
    dated = {name for name, field in zip(layout.names, first, strict=False) if is_stamp(field)}
    kinds = {name: str if name in dated | words else np.float64 for name in layout.names}
    try:
        found = _read(text, layout, {"dtype": kinds, "na_values": _MISSING})
    except ValueError:
        found = _read(text, layout, {"dtype": str})  # slower, but it finds the invalid field
    if len(found) != len(body):
        number = next((number for number, line in body if line.count('"') % 2), body[0][0])
        raise ValueError(f"line {number}: a quote is opened and not closed in its line; remove it, or close it")
    made = _table({name: found[name] for name in layout.names if name not in words}, body, layout)
    faulty = {name: problem for name in words if (problem := _number_in_words(found[name], name, body, layout))}
    faulty |= {name: array.item() for name, array in made.by_name.items() if array.dtype.kind == "O"}
    left_out = [f"Left out: '{name}' holds words, not numbers." for name in layout.names if name in words - {*faulty}]
    left_out += [f"Left out: {problem}." for problem in faulty.values()]
    by_name = {**made.by_name, **{name: np.array(problem, dtype=object) for name, problem in faulty.items()}}
    return Table(by_name, made.clocks, (*made.notes, *left_out, *comments, *layout.notes))


def _table(columns: "Mapping[str, pd.Series[Any]]", body: list[Line], layout: TableLayout) -> Table:
    """The columns without those that contain only words. A column with words among its numbers is replaced by its
    problem. Raises ValueError for a number in another notation."""
    numbers: dict[str, npt.NDArray[Any]] = {}
    stamps, words = {}, []
    for name, column in columns.items():
        if column.dtype == np.float64:
            numbers[name] = _without_blanks(column.to_numpy())
        elif (found := read_stamps(column.mask(_is_missing(column)))) is not None:
            stamps[name] = found
        elif all(map(is_text, column[~_is_missing(column)].str.strip())):
            words.append(name)
        else:
            try:
                numbers[name] = _without_blanks(_numbers(column, name, body, layout))
            except ValueError as problem:
                if not all(is_number(field, layout.decimal) or is_text(field) for field in column.str.strip()):
                    raise  # a number in another notation is an error, not a remark
                numbers[name] = np.array(FaultyColumn(problem), dtype=object)
    joined = join_stamps(stamps)
    in_seconds = {name: _seconds_name(name, columns) for name in joined}
    every = numbers | {name: _since_first(stamp.seconds) for name, stamp in joined.items()}
    notes = tuple(f"{name}: read as seconds since {stamp.first}." for name, stamp in joined.items())
    notes += tuple(f"Left out: '{name}' holds words, not numbers." for name in words)
    by_name = {in_seconds.get(name, name): every[name] for name in columns if name in every}
    return Table(by_name, tuple(in_seconds.values()), notes)


def _without_blanks(column: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
    """The single number of a column that has a value in its first row only, such as a rate."""
    single = len(column) > 1 and not np.isnan(column[0]) and bool(np.isnan(column[1:]).all())
    return np.asarray(column[0]) if single else column


def _seconds_name(name: str, others: Iterable[str]) -> str:
    """Name of a column of time stamps after its conversion to seconds."""
    plain = unit_in(name)[0]
    return f"{plain} [s]" if f"{plain} [s]" not in others else f"{plain} stamp [s]"


def _number_in_words(column: "pd.Series[str]", name: str, body: list[Line], layout: TableLayout) -> FaultyColumn:
    """The problem of a column that was recognised as words but contains a number; empty without one."""
    numbers = column.fillna("").map(lambda field: holds_number([field.strip()], layout.decimal)).to_numpy()
    if not numbers.any():
        return FaultyColumn()
    number = body[int(np.argmax(numbers))][0]
    return FaultyColumn(f"line {number}: column '{name}' holds words elsewhere; empty fields are missing samples")


def _is_missing(column: "pd.Series[str]") -> "pd.Series[bool]":
    return column.str.strip().str.lower().isin(EMPTY)


def convert_times(stored: Mapping[str, npt.NDArray[Any]]) -> Table:
    """Convert arrays of dates, times, or texts of them to seconds, like columns of a table. Raises ValueError."""
    found, clocks, notes = {}, [], []
    for name, array in stored.items():
        dated = _seconds(array)
        key = name if dated is None else _seconds_name(name, stored)
        found[key] = array if dated is None else dated[0]
        if dated is not None:
            clocks.append(key)
            notes.append(f"{name}: read as seconds since {dated[1]}.")
    return Table(found, tuple(clocks), tuple(notes))


def _seconds(array: npt.NDArray[Any]) -> tuple[npt.NDArray[np.float64], str] | None:
    """Seconds since the first of an array of dates or times, and the first; None for other arrays."""
    line = np.ravel(array)
    if len(line) < 2 or len(line) != max(array.shape) or array.dtype.kind not in "MmSU":
        return None
    if array.dtype.kind in "Mm":
        first = line[int(np.argmin(np.isnat(line)))]
        return np.where(np.isnat(line), np.nan, (line - first) / np.timedelta64(1, "s")), str(first)
    if not is_stamp(str(line[0].decode("utf-8", "replace") if isinstance(line[0], bytes) else line[0]).strip()):
        return None
    import pandas as pd

    stamps = read_stamps(pd.Series(np.char.decode(line, "utf-8") if array.dtype.kind == "S" else line))
    if stamps is None:
        return None
    joined = join_stamps({"": stamps})[""]
    return _since_first(joined.seconds), joined.first


def _since_first(seconds: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
    """Seconds since the first stamp that is not missing."""
    return np.asarray(seconds - seconds[int(np.argmax(np.isfinite(seconds)))])


def _lines(text: str, settings: CsvMap) -> list[Line]:
    """Lines that are not empty, with their numbers, after the skipped ones. Raises ValueError for too many or too long
    lines."""
    if max(text.count("\n"), text.count("\r")) > MOST_ROWS:
        raise ValueError(f"it has more than {MOST_ROWS} lines; save it as .npz or .h5")
    kept: list[Line] = []
    for number, line in enumerate(text.splitlines(), start=1):
        if len(line) > _LONGEST_LINE:
            raise ValueError(f"line {number} has {len(line)} characters; up to {_LONGEST_LINE} are read")
        if number > settings.skip_lines and line.strip():
            kept.append((number, line))
    return _with_whole_header(kept)


def _with_whole_header(lines: list[Line]) -> list[Line]:
    """Join names in quotes that contain a line break to one line; lines with a number are not changed."""
    begin = next((place for place, (_, text) in enumerate(lines) if _HOLDS_NUMBER.search(text)), 0)
    joined: list[Line] = []
    for number, text in lines[:begin]:
        if joined and joined[-1][1].count('"') % 2:
            joined[-1] = (joined[-1][0], f"{joined[-1][1]} {text}")
        else:
            joined.append((number, text))
    closed = not any(text.count('"') % 2 for _, text in joined)
    return [*joined, *lines[begin:]] if closed and len(joined) < begin else lines


def _comments(lines: list[Line], layout: TableLayout) -> tuple[str, ...]:
    """A remark on comment lines below the first row. Raises ValueError for a comment that has the fields of a row."""
    first, width = layout.body[0][0], len(layout.names)
    header = max((number for number, line in lines if number < first and not is_comment(line)), default=first)
    below = [line for line in lines if line[0] > header and is_comment(line[1])]
    found = [line for line in below if line[0] > first]
    for number, line in below if layout.delimiter != " " else ():
        fields = split_row(line, layout.delimiter)
        is_data = any(fields[1:]) if number > first else holds_number(fields[1:], layout.decimal)
        if len(fields) >= width > 1 and is_data:
            raise ValueError(
                f"line {number} begins with '{line.lstrip()[0]}' as a comment does, but has the fields of a row; "
                "correct it, or remove it"
            )
    count = f"{len(found)} comment line{'s' if len(found) > 1 else ''}"
    return (f"Left out: {count} below the first row (line {found[0][0]}).",) if found else ()


def _require_equal_rows(body: list[Line], layout: TableLayout) -> None:
    """Raises ValueError where a row has another number of fields than there are columns."""
    delimiter, columns = layout.delimiter, len(layout.names)
    for number, line in body:
        if '"' in line:
            count = len(split_row(line, delimiter))
        else:
            count = len(line.split()) if delimiter == " " else line.count(delimiter) + 1
        if count != columns:
            problem = f"line {number} has {count} fields, but there are {columns} columns"
            raise ValueError(f"{problem}; {_mend_row(number, line, body, delimiter)}")


def _mend_row(number: int, line: str, body: list[Line], delimiter: str) -> str:
    """Remedy for a row with another number of fields, by what it looks like."""
    if any(_THOUSANDS.fullmatch(field.strip(' "')) for field in re.split(r"[;\t|]", line)):
        return NO_THOUSANDS
    if delimiter in ", " and re.search(rf"(?<![\d.])[1-9]\d{{0,2}}{delimiter}\d{{3}}(?!\d)", line):
        return f"where '{delimiter}' separates thousands, {NO_THOUSANDS}; else remove that line, or complete it"
    if delimiter == " " and body[0][0] == number:
        return "where blanks separate fields, put names that contain blanks in quotes"
    if body[0][0] == number:
        return "where the line above is no header, state skip_lines and names under [csv] in the map"
    return "remove that line, or complete it"


def _read(text: str, layout: TableLayout, how: dict[str, Any]) -> "pd.DataFrame":
    # Imported only here, because the import takes longer than reading a file of any other format.
    import pandas as pd

    table: pd.DataFrame = pd.read_csv(
        io.StringIO(text),
        sep=r"\s+" if layout.delimiter == " " else layout.delimiter,
        names=list(layout.names),
        decimal=layout.decimal,
        skipinitialspace=True,
        index_col=False,
        keep_default_na=False,
        **how,
    )
    return table


def _numbers(column: "pd.Series[str]", name: str, body: list[Line], layout: TableLayout) -> npt.NDArray[np.float64]:
    """A column of texts as numbers. Raises ValueError with line, field and remedy for an invalid field."""
    import pandas as pd

    fields = column.str.strip()
    if layout.decimal == ",":
        fields = fields.str.replace(".", " ", regex=False).str.replace(",", ".", regex=False)
    missing = fields.str.lower().isin(EMPTY)
    values = pd.to_numeric(fields.where(~missing), errors="coerce")
    none = (values.isna() & ~missing).to_numpy()
    stamps = fields.map(is_stamp).to_numpy() & none if none.any() else none
    wrong = np.flatnonzero(none & ~stamps if (none & ~stamps).any() else none)
    if len(wrong):
        number = body[int(wrong[0])][0]
        text = str(column.iloc[int(wrong[0])])
        comma = layout.decimal == "." and re.fullmatch(r"[-+]?\d*,\d+([eE][-+]?\d+)?", text.strip())
        hint = '; where the decimal sign is a comma, the map says decimal = "," under [csv]' if comma else ""
        dated = f"; {STAMP_WORDS}" if re.search(r"\d[-/:]\d", text) else ""
        thousands = f"; {NO_THOUSANDS}" if _THOUSANDS.fullmatch(text.strip()) else ""
        mend = hint or dated or thousands or "; correct it, or leave it empty where the sample is missing"
        shown = text if len(text) <= _LONGEST_SHOWN else f"{text[:_LONGEST_SHOWN]}…"
        raise ValueError(f"line {number}, column '{name}': '{shown}' is not a number{mend}")
    return np.asarray(values, dtype=np.float64)
