"""Our HDF5 files: opened with their format checked, written atomically."""

import io
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, TypeVar

import h5py
import numpy as np

from equalizer.signals.signal import FloatArray
from study.regular_file import open_regular
from study.store.disk.atomic_write import write_atomically
from study.store.disk.file_errors import DAMAGED, CannotReadError, UnusableFileError
from study.store.disk.hdf5_attributes import AttributeProblemError, numbers_attribute, text_attribute
from study.store.disk.hdf5_contents import check_contents

Value = TypeVar("Value")


class Problems:
    """Collects all problems of a file, so that they can be corrected together."""

    def __init__(self) -> None:
        self.found: list[str] = []

    def attempt(self, read: Callable[[], Value], otherwise: Value) -> Value:
        """The result of `read`; a ValueError is recorded as a problem and gives `otherwise`."""
        try:
            return read()
        except ValueError as error:
            self.found.append(str(error))
            return otherwise


def is_hdf5(path: Path) -> bool:
    return path.is_file() and bool(h5py.is_hdf5(path))


def format_of(path: Path) -> str:
    """The format attribute of an HDF5 file; empty if there is none. Raises UnusableFileError."""
    with open_any_hdf5(path, "HDF5 file") as file:
        try:
            return text_attribute(file, "format", "")
        except AttributeProblemError:
            return ""


@contextmanager
def open_hdf5(path: Path, kind: str, format_name: str, version: int) -> Iterator[Any]:
    """The open file after its format and version are checked. Raises CannotReadError, UnusableFileError."""
    with open_any_hdf5(path, kind) as file:
        try:
            found = text_attribute(file, "format")
            (number,) = numbers_attribute(file, "version", 1)
        except AttributeProblemError as error:
            raise UnusableFileError(path, kind, (str(error),)) from error
        if found != format_name:
            raise UnusableFileError(path, kind, (f"its format is '{found}', not '{format_name}'",))
        if number != version:
            wrong = f"its version is {number:g}; this program reads version {version}"
            raise UnusableFileError(path, kind, (wrong,))
        yield file


def float_dataset(file: Any, name: str, shape: str) -> FloatArray:
    """shape: in words, as in "(samples, channels)". Raises ValueError with a sentence fragment."""
    dataset = file.get(name)
    if not isinstance(dataset, h5py.Dataset):
        raise ValueError(f"the dataset '{name}' is missing")
    if dataset.dtype.kind != "f":
        raise ValueError(f"{name} is of type {dataset.dtype}; it must be float32 or float64")
    if dataset.ndim != shape.count(",") + 1:
        raise ValueError(f"{name} has shape {dataset.shape}; it must be {shape}")
    return np.asarray(dataset[()], dtype=np.float64)


def write_hdf5(path: Path, fill: Callable[[Any], None], *, overwrite: bool) -> None:
    """`fill` gets an open file in memory, which is then written atomically: HDF5 on a full disk would leave a
    damaged file."""
    buffer = io.BytesIO()
    with h5py.File(buffer, "w") as file:
        fill(file)
    write_atomically(path, buffer.getvalue(), overwrite=overwrite)


@contextmanager
def open_any_hdf5(path: Path, kind: str) -> Iterator[Any]:
    """The open file of any format after its contents are checked. Raises CannotReadError, UnusableFileError."""
    try:
        open_regular(path).close()
    except OSError as problem:
        raise CannotReadError(path, problem) from problem
    try:
        with h5py.File(path, "r") as file, np.errstate(all="ignore"):
            try:
                check_contents(file)
            except ValueError as problem:
                raise UnusableFileError(path, kind, (str(problem),)) from problem
            yield file
    except DAMAGED as problem:
        # h5py raises all of these for damaged files; our own problems are already UnusableFileErrors.
        raise UnusableFileError(
            path, kind, (f"it is not HDF5 that can be read, or it is cut off ({problem})",)
        ) from problem
