"""Read the arrays of a file by name: tables, workbooks, JSON, NumPy, Matlab and HDF5 files.

The format follows from the ending of the file; `csv_arrays`, `workbook_arrays`, `json_arrays`, `mat_arrays` and
`stored_arrays` read one format each. Dates and clock times become seconds since the first.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from study.importing.arrays.csv_arrays import Table, convert_times, read_csv_arrays
from study.importing.arrays.json_arrays import read_json_arrays
from study.importing.arrays.mat_arrays import read_mat5_arrays
from study.importing.arrays.stored_arrays import read_hdf5_arrays, read_npz_arrays
from study.importing.arrays.workbook_arrays import read_workbook_arrays
from study.importing.map_format.import_map import CsvMap
from study.importing.map_format.map_errors import ImportRefusedError
from study.regular_file import open_regular
from study.store.disk.file_errors import DAMAGED, CannotReadError, UnusableFileError
from study.store.disk.hdf5_file import is_hdf5

Array = npt.NDArray[Any]
KINDS = ".csv, .txt, .tsv, .dat (tables), .xlsx, .xlsm, .json, .jsonl, .ndjson, .npz, .npy, .mat, .h5 and .hdf5"
"""File types that can be read, for messages."""
TABLES = (".csv", ".txt", ".tsv", ".dat")
"""File types that are read as text tables."""
WORKBOOKS = (".xlsx", ".xlsm")
"""File types that are read as workbooks."""
RECORDS = (".json", ".jsonl", ".ndjson")
"""File types that are read as JSON."""
HDF5 = (".h5", ".hdf5")
"""File types that are read as HDF5."""
FOREIGN = (*TABLES, *WORKBOOKS, *RECORDS, ".npz", ".npy", ".mat")
"""File types that never hold recordings of hapteq; HDF5 may."""

_CHECK = "Check the file; nothing else can be read from it."
"""Remedy where a file is damaged or of the wrong kind."""
MEND = "Do that, and import again; docs/importing.md lists the keys of a map."
"""Remedy for messages of the form "cause; remedy", which already state what to correct."""


@dataclass(frozen=True, slots=True, eq=False)
class Arrays:
    """Arrays of one file, without dimensions of length one: a column is (n,), a single number ()."""

    path: Path
    by_name: Mapping[str, Array]
    clocks: tuple[str, ...] = ()
    """Arrays that were dates or clock times, now in seconds since the first."""
    notes: tuple[str, ...] = ()
    """Sentences on how dates and clock times were read, and on what was left out."""

    @property
    def name(self) -> str:
        """Name of the file, without its folder."""
        return self.path.name


def unread_reason(array: Array) -> str:
    """Kind or problem of an array that is not read, as text, from its placeholder; empty for all other arrays."""
    text = array.item() if array.dtype.kind == "O" and array.size == 1 else ""
    return text if isinstance(text, str) else ""


def read_arrays(path: Path, table: CsvMap) -> Arrays:
    """Read all arrays of a file. table: layout of a text table (separator, decimal mark, header) where it is stated.
    Raises CannotReadError, ImportRefusedError."""
    try:
        open_regular(path).close()
    except OSError as problem:
        raise CannotReadError(path, problem) from problem
    try:
        content = _read_any(path, table)
    except UnusableFileError as refused:
        raise ImportRefusedError(path.name, refused.happened, _CHECK) from refused
    except DAMAGED as problem:
        message = str(problem) or type(problem).__name__
        # Messages of this program have the form "cause; remedy"; those of a library give only the cause.
        raise ImportRefusedError(path.name, message, MEND if "; " in message else _CHECK) from problem
    if not content.by_name:
        raise ImportRefusedError(path.name, "it holds no arrays", "Check that it is the right file.")
    return Arrays(
        path, {name: np.squeeze(array) for name, array in content.by_name.items()}, content.clocks, content.notes
    )


def _read_any(path: Path, table: CsvMap) -> Table:
    """Columns of a text table or of the sheets of a workbook, or arrays of another file."""
    if path.suffix.lower() in TABLES:
        return read_csv_arrays(path, table)
    if path.suffix.lower() in WORKBOOKS:
        return read_workbook_arrays(path, table)
    return convert_times(_read_stored(path))


def _read_stored(path: Path) -> dict[str, Array]:
    """Arrays of a file that is not a table. Raises ValueError for an unknown ending."""
    match path.suffix.lower():
        case ".npz" | ".npy":
            return read_npz_arrays(path)
        case ".json" | ".jsonl" | ".ndjson":
            return read_json_arrays(path)
        case ".mat":
            return read_hdf5_arrays(path, transposed=True) if is_hdf5(path) else read_mat5_arrays(path)
        case kind if kind in HDF5:
            return read_hdf5_arrays(path, transposed=False)
        case ".xls" | ".ods" | ".xlsb":
            raise ValueError("it is a workbook of another kind; save it as .xlsx, or the sheet as .csv")
    raise ValueError(f"its kind is not known here; known are {KINDS}")
