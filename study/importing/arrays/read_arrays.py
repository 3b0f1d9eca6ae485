"""Read the arrays of a file by name: tables, workbooks, JSON, NumPy, Matlab and HDF5 files.

The format follows from the ending of the file; `csv_arrays`, `workbook_arrays`, `json_arrays`, `mat_arrays` and
`npz_hdf5_arrays` read the formats. Dates and clock times become seconds since the first.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from study.importing.arrays.csv_arrays import Table, convert_times, read_csv_arrays
from study.importing.arrays.json_arrays import read_json_arrays
from study.importing.arrays.mat_arrays import read_mat5_arrays
from study.importing.arrays.npz_hdf5_arrays import read_hdf5_arrays, read_npz_arrays
from study.importing.arrays.workbook_arrays import read_workbook_arrays
from study.importing.map_format.import_map import CsvMap
from study.importing.map_format.map_errors import ImportRefusedError
from study.regular_file import open_regular
from study.store.disk.file_errors import DAMAGE_ERRORS, CannotReadError, UnusableFileError
from study.store.disk.hdf5_file import is_hdf5

Array = npt.NDArray[Any]
"""Array of numbers or texts, or a placeholder (an object array with one entry) for one that was not read."""
READABLE_ENDINGS = (
    ".csv, .txt, .tsv, .dat (tables), .xlsx, .xlsm, .json, .jsonl, .ndjson, .npz, .npy, .mat, .h5 and .hdf5"
)
"""All endings that can be read, for messages."""
TABLE_ENDINGS = (".csv", ".txt", ".tsv", ".dat")
"""Endings of text tables."""
WORKBOOK_ENDINGS = (".xlsx", ".xlsm")
"""Endings of workbooks."""
JSON_ENDINGS = (".json", ".jsonl", ".ndjson")
"""Endings of JSON documents and of JSON lines."""
HDF5_ENDINGS = (".h5", ".hdf5")
"""Endings of HDF5 files; a `.mat` file may be HDF5, too."""
FOREIGN_ENDINGS = (*TABLE_ENDINGS, *WORKBOOK_ENDINGS, *JSON_ENDINGS, ".npz", ".npy", ".mat")
"""Endings of files that never hold recordings in hapteq's own format; HDF5 files may."""

_CHECK_FILE_ADVICE = "Check the file; nothing else can be read from it."
"""Remedy for a file that is damaged or of the wrong kind."""
IMPORT_AGAIN = "Do that, and import again; docs/importing.md lists the keys of a map."
"""Remedy for messages of the form "cause; remedy", which already state what to correct."""


@dataclass(frozen=True, slots=True, eq=False)
class Arrays:
    """Arrays of one file, without dimensions of length one: a column is (n,), a single number ()."""

    path: Path
    by_name: Mapping[str, Array]
    """Arrays by name, in the order of the file."""
    clocks: tuple[str, ...] = ()
    """Names of arrays of dates or clock times, converted to seconds since the first."""
    notes: tuple[str, ...] = ()
    """Sentences on how dates and clock times were read, and on what was left out or not applied."""

    @property
    def name(self) -> str:
        """Name of the file, without its folder."""
        return self.path.name


def find_unread_reason(array: Array) -> str:
    """Find why an array was not read: the description of its kind or problem that stands in place of its values. Empty
    for an array with values, and for texts and objects without a description."""
    placeholder = array.item() if array.dtype.kind == "O" and array.size == 1 else ""
    return placeholder if isinstance(placeholder, str) else ""


def read_arrays(path: Path, settings: CsvMap) -> Arrays:
    """Read all arrays of a file. settings: notation of text tables and workbooks (delimiter, decimal sign, header)
    where the map states it. Raises CannotReadError where the file cannot be opened, ImportRefusedError where it is
    damaged, of another kind, too large or empty."""
    try:
        open_regular(path).close()
    except OSError as problem:
        raise CannotReadError(path, problem) from problem
    try:
        table = _read_by_ending(path, settings)
    except UnusableFileError as refused:
        raise ImportRefusedError(path.name, refused.happened, _CHECK_FILE_ADVICE) from refused
    except DAMAGE_ERRORS as problem:
        message = str(problem) or type(problem).__name__
        # Messages of this program have the form "cause; remedy"; those of a library give only the cause.
        raise ImportRefusedError(
            path.name, message, IMPORT_AGAIN if "; " in message else _CHECK_FILE_ADVICE
        ) from problem
    if not table.by_name:
        raise ImportRefusedError(path.name, "it holds no arrays", "Check that it is the right file.")
    return Arrays(path, {name: np.squeeze(array) for name, array in table.by_name.items()}, table.clocks, table.notes)


def _read_by_ending(path: Path, settings: CsvMap) -> Table:
    """Read a file by its ending: columns of a text table or of the sheets of a workbook, or arrays of another file.
    Raises the errors of the reader of the format."""
    if path.suffix.lower() in TABLE_ENDINGS:
        return read_csv_arrays(path, settings)
    if path.suffix.lower() in WORKBOOK_ENDINGS:
        return read_workbook_arrays(path, settings)
    arrays, notes = _read_non_table(path)
    table = convert_times(arrays)
    return replace(table, notes=(*table.notes, *notes))


def _read_non_table(path: Path) -> tuple[dict[str, Array], tuple[str, ...]]:
    """Read the arrays of a file that is no table or workbook, and sentences about them. Raises ValueError for an
    unknown ending, and the errors of the reader of the format."""
    match path.suffix.lower():
        case ".npz" | ".npy":
            return read_npz_arrays(path), ()
        case ".json" | ".jsonl" | ".ndjson":
            return read_json_arrays(path), ()
        case ".mat":
            return read_hdf5_arrays(path, transposed=True) if is_hdf5(path) else (read_mat5_arrays(path), ())
        case ending if ending in HDF5_ENDINGS:
            return read_hdf5_arrays(path, transposed=False)
        case ".xls" | ".ods" | ".xlsb":
            raise ValueError("it is a workbook of another kind; save it as .xlsx, or the sheet as .csv")
    raise ValueError(f"its kind is not known here; known are {READABLE_ENDINGS}")
