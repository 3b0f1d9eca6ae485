"""Reads and writes HDF5 files: format, version and contents are checked when opened; files are written atomically.

A sealed file begins with a user block (bytes that the HDF5 library ignores) of text: the SHA-256 checksum and the size
of all bytes after it. The checksum is verified before the HDF5 library opens the file, because the library may hang on
a damaged file.
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
from study.store.disk.hdf5_attributes import AttributeProblemError, read_numbers_attribute, read_text_attribute
from study.store.disk.hdf5_contents import check_contents

Value = TypeVar("Value")

SEAL = b"hapteq sha256 "
"""First bytes of a sealed file; the digest in hexadecimal and the size in bytes follow as text."""
SEAL_BYTES = 512
"""Length of the user block: the smallest that HDF5 allows."""
SIGNATURE = b"\x89HDF\r\n\x1a\n"
"""Signature of HDF5: the first bytes of a file without a user block."""
BROKEN_SEAL = (
    "its content does not fit the check sum at its beginning: it was damaged, cut off, or changed by another program "
    "since it was written"
)
"""Message for a file whose content does not agree with its seal."""


class Problems:
    """Collects all problems of a file, so that they can be reported and corrected together."""

    def __init__(self) -> None:
        self.messages: list[str] = []
        """Messages, in the order of reading."""

    def attempt(self, read: Callable[[], Value], default: Value) -> Value:
        """The result of `read`; a ValueError is recorded as a problem and gives `default`."""
        try:
            return read()
        except ValueError as error:
            self.messages.append(str(error))
            return default


def is_hdf5(path: Path) -> bool:
    """Whether the path is an HDF5 file, by its content; False where no file exists."""
    return path.is_file() and bool(h5py.is_hdf5(path))


def read_format(path: Path) -> str:
    """The format attribute of an HDF5 file; empty if there is none. Raises CannotReadError, UnusableFileError."""
    with open_any_hdf5(path, "HDF5 file") as file:
        try:
            return read_text_attribute(file, "format", "")
        except AttributeProblemError:
            return ""


@contextmanager
def open_hdf5(path: Path, kind: str, format_name: str, version: int, *, sealed: bool = False) -> Iterator[Any]:
    """The open file after its format and version are checked. kind: name of such files in messages. sealed: files of
    this format are written with a seal, though a file of another program may have no user block. Raises
    CannotReadError, UnusableFileError."""
    with open_any_hdf5(path, kind, sealed=sealed) as file:
        try:
            stored_format = read_text_attribute(file, "format")
            (stored_version,) = read_numbers_attribute(file, "version", 1)
        except AttributeProblemError as error:
            raise UnusableFileError(path, kind, (str(error),)) from error
        if stored_format != format_name:
            raise UnusableFileError(path, kind, (f"its format is '{stored_format}', not '{format_name}'",))
        if stored_version != version:
            version_problem = f"its version is {stored_version:g}; this program reads version {version}"
            raise UnusableFileError(path, kind, (version_problem,))
        yield file


def read_float_dataset(file: Any, name: str, shape: str) -> FloatArray:
    """Read a dataset of floating-point numbers. shape: in words, as in "(samples, channels)"; the number of dimensions
    is checked. Raises ValueError with a sentence fragment."""
    dataset = file.get(name)
    if not isinstance(dataset, h5py.Dataset):
        raise ValueError(f"the dataset '{name}' is missing")
    if dataset.dtype.kind != "f":
        raise ValueError(f"{name} is of type {dataset.dtype}; it must be float32 or float64")
    if dataset.ndim != shape.count(",") + 1:
        raise ValueError(f"{name} has shape {dataset.shape}; it must be {shape}")
    return np.asarray(dataset[()], dtype=np.float64)


def write_hdf5(path: Path, fill: Callable[[Any], None], *, overwrite: bool, sealed: bool = False) -> None:
    """Write a file atomically. `fill` writes into a file in memory first, because the HDF5 library would leave a
    damaged file on a full disk. Raises AlreadyThereError, CannotWriteError."""
    buffer = io.BytesIO()
    with h5py.File(buffer, "w", userblock_size=SEAL_BYTES if sealed else 0) as file:
        fill(file)
    content = buffer.getvalue()
    write_atomically(path, add_seal(content) if sealed else content, overwrite=overwrite)


def add_seal(content: bytes) -> bytes:
    """The bytes of an HDF5 file with a user block of `SEAL_BYTES`, with the seal (SHA-256 of all bytes after the block)
    written into the block."""
    body = content[SEAL_BYTES:]
    return _make_seal(hashlib.sha256(body).hexdigest(), len(body)) + body


def _make_seal(digest: str, size: int) -> bytes:
    """The user block of a sealed file: digest and size as text, filled with zeros to `SEAL_BYTES`."""
    return (SEAL + f"{digest} {size} bytes follow\n".encode("ascii")).ljust(SEAL_BYTES, b"\0")


def _check_seal(path: Path, kind: str, sealed: bool) -> None:
    """Raises UnusableFileError where the content differs from the seal, or where a format that is written with a seal
    has a user block without one; OSError where the file cannot be read."""
    with open_regular(path) as file:
        start = file.read(SEAL_BYTES)
        if start.startswith(SEAL):
            is_damaged = _make_seal(hashlib.file_digest(file, "sha256").hexdigest(), file.tell() - SEAL_BYTES) != start
        else:  # HDF5 that begins later in the file has a user block: its seal is damaged
            is_damaged = sealed and not start.startswith(SIGNATURE) and is_hdf5(path)
    if is_damaged:
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
        # h5py raises all of these for damaged files; problems found above are already UnusableFileErrors.
        raise UnusableFileError(
            path, kind, (f"it is not HDF5 that can be read, or it is cut off ({problem})",)
        ) from problem
