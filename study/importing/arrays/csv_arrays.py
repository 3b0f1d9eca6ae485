"""Columns of a table as arrays: header, delimiter and comments are detected, invalid fields are reported."""

import csv
import io
import re
from collections import Counter
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from study.importing.map_format.import_map import CsvMap
from study.store.disk.text_file import read_text

if TYPE_CHECKING:
    import pandas as pd

MOST_ROWS = 20_000_000
"""Five hours at 1 kHz."""
MOST_COLUMNS = 10_000
_DELIMITERS = (",", ";", "\t", "|")
_COMMENTS = ("#", "%")
_EMPTY = ("", "nan", "na", "n/a", "null", "-", "none")
_AS_NUMBERS: dict[str, Any] = {
    "dtype": np.float64,
    "na_values": [*_EMPTY, *(word.upper() for word in _EMPTY), "NaN", "None", "Null"],
}
_AS_WORDS: dict[str, Any] = {"dtype": str}


def read_csv_arrays(path: Path, settings: CsvMap) -> dict[str, npt.NDArray[Any]]:
    """Empty fields are missing samples. Raises CannotReadError; ValueError with line and column of a problem."""
    numbered, comment = _lines(read_text(path), settings)
    if not numbered:
        raise ValueError("it holds no lines")
    delimiter = settings.delimiter or _delimiter(numbered[0][1], settings)
    header, body = _header(numbered, delimiter, settings)
    if body is numbered and not settings.names and len(said := _fields(comment, delimiter)) == len(header):
        header = said
    if not body:
        raise ValueError("it has a header, but no rows below it")
    if len(header) > MOST_COLUMNS:
        raise ValueError(f"it has {len(header)} columns; up to {MOST_COLUMNS} are read")
    if doubled := sorted(name for name, count in Counter(header).items() if count > 1):
        raise ValueError(f"its header names '{doubled[0]}' twice; give the columns names of their own in [csv] names")
    _require_equal_rows(body, header, delimiter)
    text = "\n".join(line for _, line in body)
    try:
        numbers = _read(text, header, delimiter, settings, _AS_NUMBERS)
    except ValueError:
        words = _read(text, header, delimiter, settings, _AS_WORDS)  # slower, and it tells which field is wrong
        return {name: _numbers(words[name], name, body, settings) for name in header}
    return {name: numbers[name].to_numpy() for name in header}


def _lines(text: str, settings: CsvMap) -> tuple[list[tuple[int, str]], str]:
    """Numbered lines without comments and empty lines; and the comment directly above the first line, which is the
    header in files of some programs."""
    kept: list[tuple[int, str]] = []
    above = ""
    for number, line in enumerate(text.splitlines(), start=1):
        if len(kept) > MOST_ROWS:
            raise ValueError(f"it has more than {MOST_ROWS} rows; save it as .npz or .h5")
        if number <= settings.skip_lines or not line.strip():
            continue
        if not line.lstrip().startswith(_COMMENTS):
            kept.append((number, line))
        elif not kept:
            above = line.strip().lstrip("".join(_COMMENTS)).strip()
    return kept, above


def _delimiter(line: str, settings: CsvMap) -> str:
    counts = {mark: line.count(mark) for mark in _DELIMITERS if mark != settings.decimal}
    best = max(counts, key=lambda mark: counts[mark])
    return best if counts[best] else " "


def _header(
    numbered: list[tuple[int, str]], delimiter: str, settings: CsvMap
) -> tuple[list[str], list[tuple[int, str]]]:
    first = _fields(numbered[0][1], delimiter)
    if settings.names:
        names, body = list(settings.names), numbered
        if not all(_is_number(field, settings) for field in first):
            body = numbered[1:]
        return names, body
    if all(_is_number(field, settings) for field in first):
        return [f"column{number}" for number in range(1, len(first) + 1)], numbered
    return [name or f"column{number}" for number, name in enumerate(first, start=1)], numbered[1:]


def _fields(line: str, delimiter: str) -> list[str]:
    if not line:
        return []
    if delimiter == " " and '"' not in line:
        return line.split()
    return [field.strip() for field in next(csv.reader([line], delimiter=delimiter, skipinitialspace=True))]


def _is_number(field: str, settings: CsvMap) -> bool:
    try:
        float(field.replace(",", ".") if settings.decimal == "," else field)
    except ValueError:
        return field.lower() in _EMPTY
    return True


def _require_equal_rows(body: list[tuple[int, str]], header: list[str], delimiter: str) -> None:
    for number, line in body:
        count = len(_fields(line, delimiter)) if '"' in line or delimiter == " " else line.count(delimiter) + 1
        if count != len(header):
            raise ValueError(f"line {number} has {count} fields, but there are {len(header)} columns")


def _read(text: str, header: list[str], delimiter: str, settings: CsvMap, how: dict[str, Any]) -> "pd.DataFrame":
    # Imported where tables are read: it takes longer than all that is done with other files.
    import pandas as pd

    table: pd.DataFrame = pd.read_csv(
        io.StringIO(text),
        sep=r"\s+" if delimiter == " " else delimiter,
        names=header,
        decimal=settings.decimal,
        skipinitialspace=True,
        index_col=False,
        keep_default_na=False,
        **how,
    )
    return table


def _numbers(
    column: "pd.Series[str]", name: str, body: list[tuple[int, str]], settings: CsvMap
) -> npt.NDArray[np.float64]:
    import pandas as pd

    fields = column.str.strip()
    if settings.decimal == ",":
        fields = fields.str.replace(",", ".", regex=False)
    missing = fields.str.lower().isin(_EMPTY)
    values = pd.to_numeric(fields.where(~missing), errors="coerce")
    wrong = np.flatnonzero((values.isna() & ~missing).to_numpy())
    if len(wrong):
        number = body[int(wrong[0])][0]
        text = str(column.iloc[int(wrong[0])])
        comma = settings.decimal == "." and re.fullmatch(r"[-+]?\d*,\d+([eE][-+]?\d+)?", text.strip())
        hint = '; where the decimal sign is a comma, the map says decimal = "," under [csv]' if comma else ""
        raise ValueError(f"line {number}, column '{name}': '{text}' is not a number{hint}")
    return np.asarray(values, dtype=np.float64)
