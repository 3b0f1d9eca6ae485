"""Read the sheets of a workbook (.xlsx, .xlsm) as tables: cells are converted to lines and read like a text file.

Hidden sheets (unless the map names one) and sheets without rows of numbers are left out. With several sheets, the names
of arrays begin with that of the sheet (`Run 1/force [N]`).
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

from study.importing.arrays.csv_arrays import FaultyColumn, Table, parse_lines
from study.importing.arrays.table_cells import Line, has_number, is_comment
from study.importing.map_format.import_map import CsvMap
from study.regular_file import read_regular
from study.store.disk.declared_size import DeclaredSizeError, SizeLimit
from study.store.disk.file_errors import DAMAGE_ERRORS

if TYPE_CHECKING:
    from openpyxl import Workbook

_OLE2_SIGNATURE = b"\xd0\xcf\x11\xe0"
"""First bytes of an OLE2 container: a .xls file, or a workbook locked with a password."""
_DELIMITER = "\t"
"""Delimiter of the lines that are made from a sheet."""
_MAX_ROWS, _MAX_COLUMNS = 2**20, 2**14
"""Largest number of rows and columns of a sheet: the limits of Excel."""
_MAX_CELLS = 2**24
"""Largest number of cells that are read from a sheet; in each row those up to the last filled one count. Chosen."""
_MAX_CELLS_IN_XML = 2**22
"""Largest number of cells in the XML of a sheet, filled or only formatted. Chosen: each takes about 0.1 ms, together 7
minutes; a text table is read a hundred times faster."""
_FORMULA_WITHOUT_VALUE = re.compile(rb'<c (?![^<>]*t="str")[^<>]*><f[^<>]*(?:/>|>[^<]*</f>)(?:<v ?/>|<v></v>)?</c>')
"""Matches, in the XML of a sheet, a cell that has a formula but no stored value and is not of type text."""
_PERCENT_PATTERN = re.compile(r"%|percent|pct", re.IGNORECASE)
"""Matches, in a text cell such as a header, a word that states that its column holds percentages."""


class _UnreadSheetError(ValueError):
    """A sheet is valid but not read: too large, or formulas without values. The message states reason and remedy."""


class _PercentNumber(float):
    """A number in a cell with a percent format: the sheet displays it multiplied by 100, with a percent sign."""


def read_workbook_arrays(path: Path, settings: CsvMap) -> Table:
    """Read the arrays of a workbook; only the sheet that `settings.sheet` names, if any. Raises OSError; ValueError
    with the problem, and with the sheet if it lies in one, where the file is no workbook or too large, the sheet is
    missing, or there are no rows of numbers that can be read."""
    workbook = _open_workbook(read_regular(path))
    try:
        hidden_names = [
            sheet.title for sheet in workbook.worksheets if sheet.sheet_state != "visible" and not settings.sheet
        ]
        visible_sheets = [sheet for sheet in workbook.worksheets if sheet.title not in hidden_names]
        sheets = {sheet.title: _read_rows(sheet) for sheet in visible_sheets if settings.sheet in ("", sheet.title)}
    finally:
        workbook.close()
    if not sheets and settings.sheet:
        raise ValueError(f"it has no sheet '{settings.sheet}'; there are {', '.join(workbook.sheetnames) or 'none'}")
    numeric_sheets = {name: rows for name, rows in sheets.items() if any(_is_numeric_row(cells) for _, cells in rows)}
    if not numeric_sheets:
        raise ValueError(f"no sheet of it{' that is not hidden' if hidden_names else ''} holds rows of numbers")
    tables = {name: _make_table(name, rows, settings) for name, rows in numeric_sheets.items()}
    omission_notes = tuple(
        f"Left out: the sheet '{name}' holds no rows of numbers." for name in sheets if name not in numeric_sheets
    )
    omission_notes += tuple(f"Left out: the sheet '{name}' is hidden." for name in hidden_names)
    if len(tables) == 1:
        (single_table,) = tables.values()
        return replace(single_table, notes=(*omission_notes, *single_table.notes))
    return Table(
        {f"{name}/{key}": array for name, table in tables.items() for key, array in table.by_name.items()},
        tuple(f"{name}/{key}" for name, table in tables.items() for key in table.clocks),
        (*omission_notes, *(f"{name}: {note}" for name, table in tables.items() for note in table.notes)),
    )


def _open_workbook(data: bytes) -> "Workbook":
    """Open a workbook, after its declared sizes were checked. Raises ValueError where it is too large, damaged or of
    another kind."""
    # Imported only here, because the import takes longer than reading a file of any other format.
    from openpyxl import load_workbook

    if data.startswith(_OLE2_SIGNATURE):
        raise ValueError("it is of the old kind (.xls), or locked with a password: save it as .xlsx, without password")
    size_limit = SizeLimit(len(data))
    try:
        with zipfile.ZipFile(io.BytesIO(data)) as archive:
            for member in archive.infolist():
                size_limit.add_size(member.filename, member.file_size)
            for name in archive.namelist():
                if name.startswith("xl/worksheets/"):
                    _require_cell_limit(name, archive.read(name))
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # warnings about styles and extensions, which do not affect numbers
            return load_workbook(io.BytesIO(data), read_only=True, data_only=True)
    except (DeclaredSizeError, _UnreadSheetError):
        raise
    except DAMAGE_ERRORS as problem:
        raise ValueError("it is no .xlsx workbook, or a damaged one") from problem


def _read_rows(sheet: Any) -> list[tuple[int, tuple[Any, ...]]]:
    """Read all rows of a sheet, as `_iterate_rows`. Raises ValueError, also where the sheet is damaged."""
    try:
        return list(_iterate_rows(sheet))
    except _UnreadSheetError:
        raise
    except DAMAGE_ERRORS as problem:
        raise ValueError(f"sheet '{sheet.title}' is damaged") from problem


def _require_cell_limit(member_name: str, sheet_xml: bytes) -> None:
    """Raise ValueError where a sheet has more cells than `_MAX_CELLS_IN_XML`, or than its rows can have; they are
    counted in its XML before that is parsed."""
    cell_count, row_count = sheet_xml.count(b"<c ") + sheet_xml.count(b"<c>"), sheet_xml.count(b"<row")
    if cell_count > min(_MAX_CELLS_IN_XML, row_count * _MAX_COLUMNS):
        raise _UnreadSheetError(
            f"{member_name} of it has {cell_count} cells in {row_count} rows; save the sheet as .csv"
        )


def _require_stored_values(sheet: Any) -> None:
    """Raise ValueError for formulas whose values were not saved: the program that wrote the file did not compute
    them."""
    with sheet.parent._archive.open(sheet._worksheet_path) as member:  # noqa: SLF001 openpyxl has no public function for it
        if _FORMULA_WITHOUT_VALUE.search(member.read()):
            raise _UnreadSheetError(
                f"formulas of sheet '{sheet.title}' have no stored value; open it in a spreadsheet program and save it"
            )


def _iterate_rows(sheet: Any) -> Iterator[tuple[int, tuple[Any, ...]]]:
    """Iterate over the rows with any content: row number from 1, and values up to the last filled cell (None where
    empty). Raises ValueError for too many rows, columns or cells, and for formulas without stored values."""
    _require_stored_values(sheet)
    sheet.reset_dimensions()  # some programs state fewer rows than they write
    cell_count = 0
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        for number, cells in enumerate(sheet.iter_rows(), start=1):
            if number > _MAX_ROWS or len(cells) > _MAX_COLUMNS:
                raise _UnreadSheetError(
                    f"sheet '{sheet.title}' has cells beyond the {_MAX_ROWS} rows and {_MAX_COLUMNS} columns of one"
                )
            row = tuple(_read_cell(cell) for cell in cells)
            filled_width = _count_filled_cells(row)
            cell_count += filled_width
            if cell_count > _MAX_CELLS:
                raise _UnreadSheetError(f"it has more than {_MAX_CELLS} cells; save its sheets as .csv")
            if filled_width:
                yield number, row[:filled_width]


def _read_cell(cell: Any) -> Any:
    """Read the value of a cell; a `_PercentNumber` for a number that is displayed as a percentage."""
    value = cell.value
    return _PercentNumber(value) if isinstance(value, int | float) and "%" in cell.number_format else value


def _is_numeric_row(cells: Sequence[Any]) -> bool:
    """Whether a row has two numbers or more, or only numbers; text with a single number is taken as a setting."""
    filled_cells = [cell for cell in cells if cell is not None]
    numbers = [cell for cell in filled_cells if isinstance(cell, int | float) or _is_numeric_text(cell)]
    return len(numbers) > 1 or (bool(numbers) and len(numbers) == len(filled_cells))


def _is_numeric_text(cell: Any) -> bool:
    """Whether a cell is a text that is a number, with decimal point or comma."""
    return isinstance(cell, str) and any(has_number([cell.strip()], decimal) for decimal in (".", ","))


def _make_table(name: str, rows: Sequence[tuple[int, Sequence[Any]]], settings: CsvMap) -> Table:
    """Read the columns of one sheet. rows: row numbers and values. Raises ValueError with the sheet and the problem."""
    width = max(len(cells) for _, cells in rows)
    percent_columns = {
        column
        for _, cells in rows
        for column, cell in enumerate(cells)
        if isinstance(cell, str) and _PERCENT_PATTERN.search(cell)
    }
    # Numbers are written here with the decimal sign of the map, else a point; texts that are numbers may have a comma.
    has_fraction = any(isinstance(cell, float) and cell % 1 for _, cells in rows for cell in cells)
    decimal = settings.decimal or ("." if has_fraction else "")
    sheet_hint = "" if settings.sheet else "; to read another sheet alone, the map names it: sheet = ... under [csv]"
    try:
        table = parse_lines(
            [_make_line(number, cells, width, (percent_columns, decimal or ".")) for number, cells in rows],
            replace(settings, delimiter=_DELIMITER, decimal=decimal),
        )
    except ValueError as problem:
        raise ValueError(f"sheet '{name}', {problem}{sheet_hint}") from problem
    faulty_columns = {
        key: np.array(FaultyColumn(f"sheet '{name}', {array.item()}{sheet_hint}"), dtype=object)
        for key, array in table.by_name.items()
        if array.dtype.kind == "O"
    }
    return replace(table, by_name={**table.by_name, **faulty_columns})


def _count_filled_cells(cells: Sequence[Any]) -> int:
    """Count the cells up to the last filled one; 0 if all are empty."""
    return max((count for count, cell in enumerate(cells, start=1) if cell is not None), default=0)


def _make_line(number: int, cells: Sequence[Any], width: int, number_format: tuple[Collection[int], str]) -> Line:
    """Convert a row to a numbered line of text with `width` fields. number_format: indices of columns of percentages,
    whose numbers are written as displayed (times 100), and the decimal sign."""
    percent_columns, decimal = number_format
    fields = [
        f"{cell * 100:.15g}".replace(".", decimal)
        if isinstance(cell, _PercentNumber) and column in percent_columns
        else _format_cell(cell, decimal)
        for column, cell in enumerate(cells)
    ]
    return number, _DELIMITER.join([*fields, *[""] * (width - len(fields))])


def _format_cell(cell: Any, decimal: str) -> str:
    """Format a cell as text, in a notation that `csv_arrays` reads; a duration as hours:minutes:seconds."""
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
