"""Arrays out of NPZ, MAT and HDF5 files, under the names that they have there."""

from pathlib import Path
from typing import Any

import h5py
import numpy as np
import numpy.typing as npt
from scipy.io import loadmat
from scipy.io.matlab import MatReadError

Array = npt.NDArray[Any]


def read_npz_arrays(path: Path) -> dict[str, Array]:
    """Arrays of Python objects are left out: reading them would run code out of the file. A single `.npy` is `data`."""
    with path.open("rb") as file:
        loaded = np.load(file, allow_pickle=False)
        return {"data": loaded} if isinstance(loaded, np.ndarray) else _members(loaded)


def _members(archive: Any) -> dict[str, Array]:
    found: dict[str, Array] = {}
    for name in archive.files:
        try:
            found[name] = archive[name]
        except ValueError as problem:
            if "allow_pickle" not in str(problem):
                raise
    return found


def read_mat_arrays(path: Path) -> dict[str, Array]:
    """Fields of structures are named with a dot, as in `data.u`."""
    try:
        loaded = loadmat(path, squeeze_me=True, struct_as_record=False)
    except MatReadError as problem:
        raise ValueError(f"it is not a MAT file that can be read ({problem})") from problem
    found: dict[str, Array] = {}
    for name, value in loaded.items():
        if not name.startswith("__"):
            _add(found, name, value)
    return found


def read_hdf5_arrays(path: Path, *, transposed: bool) -> dict[str, Array]:
    """Datasets are named by their path, as in `run1/force`. transposed: dimensions in Matlab's order are turned."""
    found: dict[str, Array] = {}

    def visit(name: str, entry: Any) -> None:
        if isinstance(entry, h5py.Dataset) and entry.dtype.kind in "fiubSUO" and not name.startswith("#"):
            values = np.asarray(entry[()])
            named = name.replace("/", ".") if transposed else name
            found[named] = values.T if transposed else values

    with h5py.File(path, "r") as file:
        file.visititems(visit)
    return found


def _add(found: dict[str, Array], name: str, value: Any) -> None:
    if hasattr(value, "_fieldnames"):
        for field in value._fieldnames:  # noqa: SLF001 - scipy's only way to list the fields of a structure
            _add(found, f"{name}.{field}", getattr(value, field))
    else:
        found[name] = np.asarray(value)
