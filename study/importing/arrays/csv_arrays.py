"""Columns of a table as arrays: encoding and layout are detected, invalid fields are reported."""

import codecs
import io
import re
from collections import Counter
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from study.importing.arrays.table_layout import EMPTY, Line, TableLayout, find_layout, is_comment, split_row
from study.importing.map_format.import_map import CsvMap
from study.regular_file import TABLE_BYTES, read_regular
from study.store.disk.file_errors import CannotReadError

if TYPE_CHECKING:
    import pandas as pd

MOST_ROWS = 20_000_000
"""Five hours at 1 kHz."""
MOST_COLUMNS = 10_000
_LOOKED_AT = 4096
"""Bytes in which UTF-16 without a mark shows: every other one of a table in it is zero."""
_AS_NUMBERS: dict[str, Any] = {
    "dtype": np.float64,
    "na_values": [*EMPTY, *(word.upper() for word in EMPTY), "NaN", "None", "Null"],
}
_AS_WORDS: dict[str, Any] = {"dtype": str}


def read_csv_arrays(path: Path, settings: CsvMap) -> dict[str, npt.NDArray[Any]]:
    """Empty fields are missing samples. Raises CannotReadError; ValueError with line and column of a problem."""
    layout = find_layout(_lines(_read_text(path), settings), settings)
    if not layout.body:
        raise ValueError("it has a header, but no rows below it")
    if len(layout.names) > MOST_COLUMNS:
        raise ValueError(f"it has {len(layout.names)} columns; up to {MOST_COLUMNS} are read")
    if doubled := sorted(name for name, count in Counter(layout.names).items() if count > 1):
        raise ValueError(f"its header names '{doubled[0]}' twice; give the columns names of their own in [csv] names")
    body = [line for line in layout.body if not is_comment(line[1])]
    _require_equal_rows(body, layout)
    text = "\n".join(line for _, line in body)
    try:
        numbers = _read(text, layout, _AS_NUMBERS)
    except ValueError:
        words = _read(text, layout, _AS_WORDS)  # slower, and it tells which field is wrong
        return {name: _numbers(words[name], name, body, layout) for name in layout.names}
    return {name: numbers[name].to_numpy() for name in layout.names}


def _read_text(path: Path) -> str:
    """UTF-8, UTF-16, or what Windows writes in western languages. Raises CannotReadError, ValueError."""
    try:
        data = read_regular(path, TABLE_BYTES)
        if data.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)):
            return data.decode("utf-16")
        if b"\0" in data[:_LOOKED_AT]:
            high_bytes = data[1:_LOOKED_AT:2], data[:_LOOKED_AT:2]
            for zeros, encoding in zip(high_bytes, ("utf-16-le", "utf-16-be"), strict=True):
                if 2 * zeros.count(0) > len(zeros):
                    return data.decode(encoding)
            raise ValueError("it holds bytes of zero, as no text does; is it a table?")
        return data.decode("utf-8-sig")
    except UnicodeDecodeError as problem:
        if problem.encoding != "utf-8":
            raise ValueError(f"it is no whole {problem.encoding} text") from problem
    except OSError as problem:
        raise CannotReadError(path, problem) from problem
    return data.decode("cp1252", errors="replace")


def _lines(text: str, settings: CsvMap) -> list[Line]:
    kept: list[Line] = []
    for number, line in enumerate(text.splitlines(), start=1):
        if len(kept) > MOST_ROWS:
            raise ValueError(f"it has more than {MOST_ROWS} rows; save it as .npz or .h5")
        if number > settings.skip_lines and line.strip():
            kept.append((number, line))
    return kept


def _require_equal_rows(body: list[Line], layout: TableLayout) -> None:
    delimiter, columns = layout.delimiter, len(layout.names)
    for number, line in body:
        count = len(split_row(line, delimiter)) if '"' in line or delimiter == " " else line.count(delimiter) + 1
        if count != columns:
            raise ValueError(f"line {number} has {count} fields, but there are {columns} columns")


def _read(text: str, layout: TableLayout, how: dict[str, Any]) -> "pd.DataFrame":
    # Imported where tables are read: it takes longer than all that is done with other files.
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
    import pandas as pd

    fields = column.str.strip()
    if layout.decimal == ",":
        fields = fields.str.replace(".", " ", regex=False).str.replace(",", ".", regex=False)
    missing = fields.str.lower().isin(EMPTY)
    values = pd.to_numeric(fields.where(~missing), errors="coerce")
    wrong = np.flatnonzero((values.isna() & ~missing).to_numpy())
    if len(wrong):
        number = body[int(wrong[0])][0]
        text = str(column.iloc[int(wrong[0])])
        comma = layout.decimal == "." and re.fullmatch(r"[-+]?\d*,\d+([eE][-+]?\d+)?", text.strip())
        hint = '; where the decimal sign is a comma, the map says decimal = "," under [csv]' if comma else ""
        raise ValueError(f"line {number}, column '{name}': '{text}' is not a number{hint}")
    return np.asarray(values, dtype=np.float64)
