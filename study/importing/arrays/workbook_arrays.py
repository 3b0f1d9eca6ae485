"""Read the sheets of a workbook (.xlsx, .xlsm) as tables: cells are converted to lines and read like a text file.

Hidden sheets and sheets without rows of numbers are left out. With several sheets, the names of arrays begin with that
of the sheet (`Run 1/force [N]`).
"""

import io
import re
import warnings
import zipfile
from collections.abc import Collection, Iterator, Sequence
from dataclasses import replace
from datetime import date, datetime, time, timedelta
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from study.importing.arrays.csv_arrays import FaultyColumn, Table, read_lines
from study.importing.arrays.table_cells import Line, holds_number, is_comment
from study.importing.map_format.import_map import CsvMap
from study.regular_file import read_regular
from study.store.disk.declared_size import DeclaredSizeError, SizeLimit
from study.store.disk.file_errors import DAMAGED

if TYPE_CHECKING:
    from openpyxl import Workbook

_BEGIN_OF_OLD = b"\xd0\xcf\x11\xe0"
"""First bytes of the container of .xls and of locked workbooks (OLE2)."""
_DELIMITER = "\t"
"""Delimiter of the lines that are made from a sheet."""
_MOST_ROWS, _MOST_COLUMNS = 2**20, 2**14
"""Most rows and columns of a sheet, by the standard."""
_MOST_CELLS = 2**24
"""Most filled cells that are read from a sheet."""
_MAX_CELLS_IN_XML = 2**22
"""Most cells of a sheet: each takes a tenth of a millisecond; a text table is read a hundred times faster."""
_NEVER_COMPUTED = re.compile(rb'<c (?![^<>]*t="str")[^<>]*><f[^<>]*(?:/>|>[^<]*</f>)(?:<v ?/>|<v></v>)?</c>')
"""In the XML of a sheet: a cell with a formula but no stored value, and not of type text."""
_PERCENT = re.compile(r"%|percent|pct", re.IGNORECASE)
"""Words in a text cell by which its column holds percentages."""


class _NotReadError(ValueError):
    """A valid sheet that is not read; the message states the reason."""


class _Percent(float):
    """A number that the sheet displays multiplied by 100, with a percent sign."""


def read_workbook_arrays(path: Path, settings: CsvMap) -> Table:
    """Arrays of a workbook. Raises OSError; ValueError with the sheet and the problem."""
    book = _open_workbook(read_regular(path))
    try:
        hidden = [sheet.title for sheet in book.worksheets if sheet.sheet_state != "visible" and not settings.sheet]
        visible = [sheet for sheet in book.worksheets if sheet.title not in hidden]
        sheets = {sheet.title: _read_rows(sheet) for sheet in visible if settings.sheet in ("", sheet.title)}
    finally:
        book.close()
    if not sheets and settings.sheet:
        raise ValueError(f"it has no sheet '{settings.sheet}'; there are {', '.join(book.sheetnames) or 'none'}")
    numeric_sheets = {name: rows for name, rows in sheets.items() if any(_is_of_numbers(cells) for _, cells in rows)}
    if not numeric_sheets:
        raise ValueError(f"no sheet of it{' that is not hidden' if hidden else ''} holds rows of numbers")
    tables = {name: _make_table(name, rows, settings) for name, rows in numeric_sheets.items()}
    omitted = tuple(
        f"Left out: the sheet '{name}' holds no rows of numbers." for name in sheets if name not in numeric_sheets
    )
    omitted += tuple(f"Left out: the sheet '{name}' is hidden." for name in hidden)
    if len(tables) == 1:
        (single_table,) = tables.values()
        return replace(single_table, notes=(*omitted, *single_table.notes))
    return Table(
        {f"{name}/{key}": array for name, table in tables.items() for key, array in table.by_name.items()},
        tuple(f"{name}/{key}" for name, table in tables.items() for key in table.clocks),
        (*omitted, *(f"{name}: {note}" for name, table in tables.items() for note in table.notes)),
    )


def _open_workbook(data: bytes) -> "Workbook":
    # Imported only here, because the import takes longer than reading a file of any other format.
    """The workbook, after its declared sizes were checked. Raises ValueError where it is too large, damaged or of
    another kind."""
    from openpyxl import load_workbook

    if data.startswith(_BEGIN_OF_OLD):
        raise ValueError("it is of the old kind (.xls), or locked with a password: save it as .xlsx, without password")
    limit = SizeLimit(len(data))
    try:
        with zipfile.ZipFile(io.BytesIO(data)) as archive:
            for member in archive.infolist():
                limit.add_size(member.filename, member.file_size)
            for name in archive.namelist():
                if name.startswith("xl/worksheets/"):
                    _require_few_cells(name, archive.read(name))
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # warnings about styles and extensions, which do not affect numbers
            return load_workbook(io.BytesIO(data), read_only=True, data_only=True)
    except (DeclaredSizeError, _NotReadError):
        raise
    except DAMAGED as problem:
        raise ValueError("it is no .xlsx workbook, or a damaged one") from problem


def _read_rows(sheet: Any) -> list[tuple[int, tuple[Any, ...]]]:
    """All rows of a sheet with their numbers. Raises ValueError where the sheet is damaged."""
    try:
        return list(_iterate_rows(sheet))
    except _NotReadError:
        raise
    except DAMAGED as problem:
        raise ValueError(f"sheet '{sheet.title}' is damaged") from problem


def _require_few_cells(member: str, sheet: bytes) -> None:
    """Raises ValueError where a sheet has too many cells. They are counted in the XML before it is parsed."""
    cells, rows = sheet.count(b"<c ") + sheet.count(b"<c>"), sheet.count(b"<row")
    if cells > min(_MAX_CELLS_IN_XML, rows * _MOST_COLUMNS):
        raise _NotReadError(f"{member} of it has {cells} cells in {rows} rows; save the sheet as .csv")


def _require_computed(sheet: Any) -> None:
    """Raises ValueError for formulas whose values were not saved."""
    with sheet.parent._archive.open(sheet._worksheet_path) as member:  # noqa: SLF001 openpyxl has no public function for it
        if _NEVER_COMPUTED.search(member.read()):
            raise _NotReadError(
                f"formulas of sheet '{sheet.title}' have no stored value; open it in a spreadsheet program and save it"
            )


def _iterate_rows(sheet: Any) -> Iterator[tuple[int, tuple[Any, ...]]]:
    """Rows with any content, with their numbers. Raises ValueError for too many rows, columns or cells, and for
    formulas without stored values."""
    _require_computed(sheet)
    sheet.reset_dimensions()  # some programs state fewer rows than they write
    cell_count = 0
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        for number, cells in enumerate(sheet.iter_rows(), start=1):
            if number > _MOST_ROWS or len(cells) > _MOST_COLUMNS:
                raise _NotReadError(
                    f"sheet '{sheet.title}' has cells beyond the {_MOST_ROWS} rows and {_MOST_COLUMNS} columns of one"
                )
            row = tuple(_read_cell(cell) for cell in cells)
            width = _count_cells(row)
            cell_count += width
            if cell_count > _MOST_CELLS:
                raise _NotReadError(f"it has more than {_MOST_CELLS} cells; save its sheets as .csv")
            if width:
                yield number, row[:width]


def _read_cell(cell: Any) -> Any:
    """Value of a cell; a `_Percent` where the cell is displayed as a percentage."""
    value = cell.value
    return _Percent(value) if isinstance(value, int | float) and "%" in cell.number_format else value


def _is_of_numbers(cells: Sequence[Any]) -> bool:
    """Whether a row has two numbers or more, or only numbers. A name with a single number is a setting."""
    present = [cell for cell in cells if cell is not None]
    numbers = [cell for cell in present if isinstance(cell, int | float) or _is_number_in_text(cell)]
    return len(numbers) > 1 or (bool(numbers) and len(numbers) == len(present))


def _is_number_in_text(cell: Any) -> bool:
    return isinstance(cell, str) and any(holds_number([cell.strip()], mark) for mark in (".", ","))


def _make_table(name: str, rows: Sequence[tuple[int, Sequence[Any]]], settings: CsvMap) -> Table:
    """Columns of one sheet. Raises ValueError with the sheet and the problem."""
    width = max(len(cells) for _, cells in rows)
    percents = {
        column
        for _, cells in rows
        for column, cell in enumerate(cells)
        if isinstance(cell, str) and _PERCENT.search(cell)
    }
    # Numbers of a sheet have no decimal sign; texts that are numbers may have either.
    has_fraction = any(isinstance(cell, float) and cell % 1 for _, cells in rows for cell in cells)
    decimal = settings.decimal or ("." if has_fraction else "")
    text = "" if settings.sheet else "; to read another sheet alone, the map names it: sheet = ... under [csv]"
    try:
        table = read_lines(
            [_make_line(number, cells, width, (percents, decimal or ".")) for number, cells in rows],
            replace(settings, delimiter=_DELIMITER, decimal=decimal),
        )
    except ValueError as problem:
        raise ValueError(f"sheet '{name}', {problem}{text}") from problem
    faulty = {
        key: np.array(FaultyColumn(f"sheet '{name}', {array.item()}{text}"), dtype=object)
        for key, array in table.by_name.items()
        if array.dtype.kind == "O"
    }
    return replace(table, by_name={**table.by_name, **faulty})


def _count_cells(cells: Sequence[Any]) -> int:
    """Number of cells without empty ones at the end."""
    return max((count for count, cell in enumerate(cells, start=1) if cell is not None), default=0)


def _make_line(number: int, cells: Sequence[Any], width: int, number_format: tuple[Collection[int], str]) -> Line:
    """The cells of a row as a line of text. number_format: indices of columns with percentages, whose numbers are taken
    as displayed, and the decimal sign."""
    percents, decimal = number_format
    fields = [
        f"{cell * 100:.15g}".replace(".", decimal)
        if isinstance(cell, _Percent) and column in percents
        else _format_cell(cell, decimal)
        for column, cell in enumerate(cells)
    ]
    return number, _DELIMITER.join([*fields, *[""] * (width - len(fields))])


def _format_cell(cell: Any, decimal: str) -> str:
    """A cell as text, in a notation that `csv_arrays` reads."""
    match cell:
        case None:
            return ""
        case bool():
            return str(int(cell))
        case int() | float():
            return (float.__repr__(cell) if isinstance(cell, float) else repr(cell)).replace(".", decimal)
        case datetime():
            return cell.isoformat(" ")
        case date() | time():
            return cell.isoformat()
        case timedelta():
            minutes, seconds = divmod(cell.total_seconds(), 60)
            return f"{int(minutes // 60)}:{int(minutes % 60):02d}:{seconds:09.6f}"
    text = " ".join(str(cell).replace('"', "").split())
    return f'"{text}"' if is_comment(text) else text  # quoted, because a sheet has no comment lines
