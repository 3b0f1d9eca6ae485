"""Our HDF5 files: opened with their format checked, written atomically.

A sealed file begins with a block of text that HDF5 leaves to its user, with the check sum of all that follows: the HDF5
library may hang on a damaged file, so the sum is checked before the library sees it.
"""

import hashlib
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

SEAL = b"hapteq sha256 "
"""First bytes of a sealed file; digest and size follow as text."""
SEAL_BYTES = 512
"""The smallest block that HDF5 leaves to its user."""
SIGNATURE = b"\x89HDF\r\n\x1a\n"
"""First bytes of HDF5: at the start of a file without such a block."""
BROKEN_SEAL = (
    "its content does not fit the check sum at its beginning: it was damaged, cut off, or changed by another program "
    "since it was written"
)
"""Problem of a file whose content differs from its seal."""


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
    """Whether the path is an HDF5 file, by its content; False where no file exists."""
    return path.is_file() and bool(h5py.is_hdf5(path))


def format_of(path: Path) -> str:
    """The format attribute of an HDF5 file; empty if there is none. Raises UnusableFileError."""
    with open_any_hdf5(path, "HDF5 file") as file:
        try:
            return text_attribute(file, "format", "")
        except AttributeProblemError:
            return ""


@contextmanager
def open_hdf5(path: Path, kind: str, format_name: str, version: int, *, sealed: bool = False) -> Iterator[Any]:
    """The open file after its format and version are checked. sealed: as `write_hdf5` writes this format; one that
    another program wrote may have no such block at all. Raises CannotReadError, UnusableFileError."""
    with open_any_hdf5(path, kind, sealed=sealed) as file:
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
    """Read a dataset of numbers. shape: in words, as in "(samples, channels)". Raises ValueError with a sentence
    fragment."""
    dataset = file.get(name)
    if not isinstance(dataset, h5py.Dataset):
        raise ValueError(f"the dataset '{name}' is missing")
    if dataset.dtype.kind != "f":
        raise ValueError(f"{name} is of type {dataset.dtype}; it must be float32 or float64")
    if dataset.ndim != shape.count(",") + 1:
        raise ValueError(f"{name} has shape {dataset.shape}; it must be {shape}")
    return np.asarray(dataset[()], dtype=np.float64)


def write_hdf5(path: Path, fill: Callable[[Any], None], *, overwrite: bool, sealed: bool = False) -> None:
    """`fill` gets an open file in memory, which is then written atomically: HDF5 on a full disk would leave a
    damaged file."""
    buffer = io.BytesIO()
    with h5py.File(buffer, "w", userblock_size=SEAL_BYTES if sealed else 0) as file:
        fill(file)
    content = buffer.getvalue()
    write_atomically(path, with_seal(content) if sealed else content, overwrite=overwrite)


def with_seal(content: bytes) -> bytes:
    """The bytes of an HDF5 file with its checksum (SHA-256 of what follows) written into its user block."""
    body = content[SEAL_BYTES:]
    return _seal(hashlib.sha256(body).hexdigest(), len(body)) + body


def _seal(digest: str, size: int) -> bytes:
    return (SEAL + f"{digest} {size} bytes follow\n".encode("ascii")).ljust(SEAL_BYTES, b"\0")


def _check_seal(path: Path, kind: str, sealed: bool) -> None:
    """Raises UnusableFileError where a file is not as it was sealed, and OSError."""
    with open_regular(path) as file:
        start = file.read(SEAL_BYTES)
        if start.startswith(SEAL):
            broken = _seal(hashlib.file_digest(file, "sha256").hexdigest(), file.tell() - SEAL_BYTES) != start
        else:  # what is HDF5 from a later place on had a seal
            broken = sealed and not start.startswith(SIGNATURE) and is_hdf5(path)
    if broken:
        raise UnusableFileError(path, kind, (BROKEN_SEAL,))


@contextmanager
def open_any_hdf5(path: Path, kind: str, *, sealed: bool = False) -> Iterator[Any]:
    """The open file of any format after its contents are checked. Raises CannotReadError, UnusableFileError."""
    try:
        _check_seal(path, kind, sealed)
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
