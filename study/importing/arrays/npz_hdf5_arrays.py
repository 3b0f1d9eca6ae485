"""Read the arrays of NPZ, NPY and HDF5 files by name.

Declared sizes are checked before memory is allocated, and nothing in a file is executed: arrays of Python objects,
which would have to be unpickled, are not read.
"""

import math
import zipfile
from pathlib import Path
from typing import Any, BinaryIO

import h5py
import numpy as np
import numpy.typing as npt

from study.importing.arrays.mat_arrays import describe_text
from study.regular_file import open_regular
from study.store.disk.declared_size import SizeLimit
from study.store.disk.hdf5_contents import iterate_datasets
from study.store.disk.hdf5_file import open_any_hdf5

Array = npt.NDArray[Any]
"""Array of any type and shape."""
_COMPRESSIONS = (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED)
"""Compressions that numpy.savez and numpy.savez_compressed write; no other one is read."""
_CELL_DESCRIPTION = "a cell, which is read where the file was saved with -v7"
"""Description of a Matlab cell, which an HDF5 file stores as references."""
_OTHER_DESCRIPTION = (
    "of a type that is not read, such as rows of several columns; each column is read from a dataset of its own"
)
"""Description of a dataset of compound, complex or other types."""
_MAX_TEXT_CHARACTERS = 10_000
"""Largest length of a Matlab text that is read to describe it. Chosen."""
_NON_NUMERIC = np.array(None, dtype=object)
"""Placeholder for the values of HDF5 texts and objects that are listed but not read."""


def read_npz_arrays(path: Path) -> dict[str, Array]:
    """Read the arrays of an NPZ or NPY file by name; that of an NPY file is called `data`. The first bytes decide which
    format it is; arrays of Python objects are left out. Raises OSError where it cannot be opened, ValueError or another
    exception of `file_errors.DAMAGE_ERRORS` where it is damaged, DeclaredSizeError where it is too large."""
    with open_regular(path) as file:
        limit = SizeLimit(path.stat().st_size)
        if file.peek(6)[:6] == b"\x93NUMPY":
            array = _read_npy(file, path.stat().st_size, limit, "data")
            return {} if array is None else {"data": array}
        with zipfile.ZipFile(file) as archive:
            return _read_members(archive, limit)


def _read_members(archive: zipfile.ZipFile, limit: SizeLimit) -> dict[str, Array]:
    """Read the members of an archive whose names end in .npy, except Python objects. Raises ValueError for a
    compression that numpy does not write, and as `_read_npy`."""
    arrays: dict[str, Array] = {}
    for member in archive.infolist():
        if not member.filename.endswith(".npy"):
            continue
        name = member.filename.removesuffix(".npy")
        if member.compress_type not in _COMPRESSIONS:
            raise ValueError(f"{name} is packed in a way that numpy does not use; save it with numpy.savez")
        with archive.open(member) as content:
            array = _read_npy(content, member.file_size, limit, name)
        if array is not None:
            arrays[name] = array
    return arrays


def _read_npy(file: Any, container_bytes: int, limit: SizeLimit, name: str) -> Array | None:
    """Read one array; None for Python objects. container_bytes: size of the unpacked member or file. name: for
    messages. Raises ValueError where the declared shape needs more bytes or the data end early, DeclaredSizeError where
    it is too large."""
    shape, fortran_order, dtype = _read_header(file)
    if dtype.hasobject:
        return None
    declared_bytes = math.prod(shape) * dtype.itemsize
    if not 0 <= declared_bytes <= container_bytes:
        raise ValueError(
            f"{name} is said to have the shape {shape}, {declared_bytes} bytes, but holds {container_bytes}"
        )
    limit.add_size(name, declared_bytes)
    content = file.read(declared_bytes)
    if len(content) != declared_bytes:
        raise ValueError(f"{name} is cut off after {len(content)} of {declared_bytes} bytes")
    return np.frombuffer(content, dtype).reshape(shape, order="F" if fortran_order else "C")


def _read_header(file: BinaryIO) -> tuple[tuple[int, ...], bool, np.dtype[Any]]:
    """Read the header of an NPY array: shape, whether the order is Fortran, and data type. Raises ValueError for an
    unknown version of the format."""
    version = np.lib.format.read_magic(file)
    if version == (1, 0):
        return np.lib.format.read_array_header_1_0(file)
    if version == (2, 0):
        return np.lib.format.read_array_header_2_0(file)
    raise ValueError(f"it is of version {version[0]}.{version[1]} of the format; 1.0 and 2.0 can be read")


def read_hdf5_arrays(path: Path, *, transposed: bool) -> tuple[dict[str, Array], tuple[str, ...]]:
    """Read datasets by path, as in `run1/force`, and sentences on scales that were not applied. transposed: a file of
    Matlab 7.3, whose dimensions are reversed; names then have dots in place of slashes. Texts, cells and objects are
    replaced by placeholders, except one-dimensional arrays of texts, which may be dates, and other types such as
    compound ones. Left out are datasets without a shape, and names that begin with "#" (internal to Matlab). Raises
    UnusableFileError where the file cannot be read."""
    arrays: dict[str, Array] = {}
    notes: list[str] = []
    with open_any_hdf5(path, "HDF5 file") as file:
        for name, entry in iterate_datasets(file):
            if name.startswith("#") or entry.shape is None:
                continue
            if reason := _describe_unread_class(entry):
                values = np.array(reason, dtype=object)
            elif entry.attrs.get("MATLAB_empty", 0):
                values = np.empty(0)  # the dataset holds the dimensions of an empty array
            elif entry.dtype.kind in "fiub":
                values = np.asarray(entry[()])
            elif h5py.check_string_dtype(entry.dtype) is not None and entry.ndim == 1 and len(entry):
                values = np.asarray(entry.asstr(errors="replace")[()], dtype=str)
            elif entry.dtype.kind in "SUO":
                values = _NON_NUMERIC
            else:
                values = np.array(_OTHER_DESCRIPTION, dtype=object)
            array_name = name.replace("/", ".") if transposed else name
            arrays[array_name] = values.T if transposed else values
            if stated_scale := _describe_scale(entry):
                notes.append(
                    f"{array_name}: its attribute {stated_scale} was not applied; a map can state it in `value`."
                )
    return arrays, tuple(notes)


def _describe_scale(entry: Any) -> str:
    """Describe the scale and offset that the attributes of a dataset state (conventions of netCDF), each cut to 60
    characters; empty where there are none, or they change nothing."""
    neutral_values = {"scale_factor": 1, "add_offset": 0}
    stated = {name: np.ravel(entry.attrs[name]).tolist() for name in neutral_values if name in entry.attrs}
    return " and ".join(f"{name} = {', '.join(map(str, values)):.60}" for name, values in stated.items()
                        if values != [neutral_values[name]])  # fmt: skip


def _describe_unread_class(entry: Any) -> str:
    """Describe a dataset of a Matlab class that is not read (cell, text, object); empty for any other dataset."""
    matlab_class = entry.attrs.get("MATLAB_class", b"")
    if matlab_class == b"cell":
        return _CELL_DESCRIPTION
    if "MATLAB_object_decode" in entry.attrs:
        return f"an object of the class {matlab_class.decode('utf-8', 'replace')}"
    if matlab_class != b"char":
        return ""
    is_row = entry.ndim == 2 and entry.shape[1] == 1 and entry.dtype.kind == "u" and entry.size < _MAX_TEXT_CHARACTERS
    return describe_text("".join(map(chr, entry[:, 0])) if is_row else "")  # stored as the numbers of its characters
