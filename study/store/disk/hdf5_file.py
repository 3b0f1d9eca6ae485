"""Read and write HDF5 files: checksum, contents, format and version are checked in this order when a file of a known
format is opened (`open_hdf5`); files are written atomically.

A sealed file begins with a user block (bytes that the HDF5 library ignores), which states the SHA-256 checksum and the
size of all bytes after it. The checksum is verified before the HDF5 library opens the file, because the library may
hang on a damaged file.
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
from study.store.disk.file_errors import DAMAGE_ERRORS, HDF5_SIGNATURE, CannotReadError, UnusableFileError
from study.store.disk.hdf5_attributes import AttributeProblemError, read_numbers_attribute, read_text_attribute
from study.store.disk.hdf5_contents import check_contents

Value = TypeVar("Value")
"""Type of a value that is read from a file."""

SEAL_PREFIX = b"hapteq sha256 "
"""First bytes of a sealed file. The hexadecimal SHA-256 digest and the size in bytes follow, as ASCII text."""
USER_BLOCK_BYTES = 512
"""Length of the user block of a sealed file (bytes): the smallest that HDF5 allows."""
BROKEN_SEAL_PROBLEM = (
    "its content does not fit the check sum at its beginning: it was damaged, cut off, or changed by another program "
    "since it was written"
)
"""Problem of a file whose content differs from its seal: a sentence fragment for `UnusableFileError`."""


class ProblemCollector:
    """Collector of the problems of a file (sentence fragments), so that a reader can report all of them in one
    error."""

    def __init__(self) -> None:
        self.messages: list[str] = []
        """Messages, in the order of reading."""

    def attempt(self, read: Callable[[], Value], default: Value) -> Value:
        """Return the result of `read`; where it raises ValueError, record the message and return `default`."""
        try:
            return read()
        except ValueError as error:
            self.messages.append(str(error))
            return default


def is_hdf5(path: Path) -> bool:
    """Whether the path is a regular file with an HDF5 signature; False where it is missing."""
    return path.is_file() and bool(h5py.is_hdf5(path))


def read_format(path: Path) -> str:
    """Read the attribute `format` of an HDF5 file; empty if it is missing or no text. Raises CannotReadError where the
    file cannot be read, UnusableFileError where it is no valid HDF5, its seal is broken, or `check_contents` refuses
    it."""
    with open_any_hdf5(path, "HDF5 file") as file:
        try:
            return read_text_attribute(file, "format", "")
        except AttributeProblemError:
            return ""


@contextmanager
def open_hdf5(path: Path, kind: str, format_name: str, version: int, *, sealed: bool = False) -> Iterator[Any]:
    """Open a file for reading, and check its seal, contents, format and version. kind: name of such files in messages.
    sealed: hapteq writes this format with a seal; a file without a user block, of another program, is accepted all the
    same. Raises CannotReadError where the file cannot be read, UnusableFileError where a check fails, and instead of a
    `DAMAGE_ERRORS` exception within the context."""
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


def read_float_dataset(file: Any, name: str, shape_text: str) -> FloatArray:
    """Read a dataset of floating-point numbers, such as float32, as float64. shape_text: names of the dimensions for
    messages, as in "(samples, channels)"; their number is checked. Raises ValueError, with a sentence fragment, where
    the dataset is missing or has another type or number of dimensions."""
    dataset = file.get(name)
    if not isinstance(dataset, h5py.Dataset):
        raise ValueError(f"the dataset '{name}' is missing")
    if dataset.dtype.kind != "f":
        raise ValueError(f"{name} is of type {dataset.dtype}; it must be float32 or float64")
    if dataset.ndim != shape_text.count(",") + 1:
        raise ValueError(f"{name} has shape {dataset.shape}; it must be {shape_text}")
    return np.asarray(dataset[()], dtype=np.float64)


def write_hdf5(path: Path, fill: Callable[[Any], None], *, overwrite: bool, sealed: bool = False) -> None:
    """Write an HDF5 file atomically. fill: writes the contents into the `h5py.File` that it is called with. That file
    is in memory, because on a full disk the HDF5 library would leave a damaged file. sealed: add the seal. Raises
    AlreadyExistsError where the file exists unless `overwrite`, CannotWriteError where it cannot be written."""
    buffer = io.BytesIO()
    with h5py.File(buffer, "w", userblock_size=USER_BLOCK_BYTES if sealed else 0) as file:
        fill(file)
    content = buffer.getvalue()
    write_atomically(path, add_seal(content) if sealed else content, overwrite=overwrite)


def add_seal(content: bytes) -> bytes:
    """Write the seal into the user block of an HDF5 file. content: all bytes of the file, whose user block has
    `USER_BLOCK_BYTES`; the content of the block is replaced."""
    body = content[USER_BLOCK_BYTES:]
    return _make_seal(hashlib.sha256(body).hexdigest(), len(body)) + body


def _make_seal(digest: str, size: int) -> bytes:
    """Make the user block of a sealed file: digest and size (bytes) as text, filled with zeros to
    `USER_BLOCK_BYTES`."""
    return (SEAL_PREFIX + f"{digest} {size} bytes follow\n".encode("ascii")).ljust(USER_BLOCK_BYTES, b"\0")


def _check_seal(path: Path, kind: str, sealed: bool) -> None:
    """Raise UnusableFileError where the content differs from the seal, or, if `sealed`, where a user block has no valid
    seal; OSError where the file cannot be read. Any other file without a seal is accepted."""
    with open_regular(path) as file:
        user_block = file.read(USER_BLOCK_BYTES)
        if user_block.startswith(SEAL_PREFIX):
            is_damaged = (
                _make_seal(hashlib.file_digest(file, "sha256").hexdigest(), file.tell() - USER_BLOCK_BYTES)
                != user_block
            )
        else:  # HDF5 whose signature comes later has a user block, whose seal is therefore damaged
            is_damaged = sealed and not user_block.startswith(HDF5_SIGNATURE) and is_hdf5(path)
    if is_damaged:
        raise UnusableFileError(path, kind, (BROKEN_SEAL_PROBLEM,))


@contextmanager
def open_any_hdf5(path: Path, kind: str, *, sealed: bool = False) -> Iterator[Any]:
    """Open a file of any format for reading, and check its seal and contents. Warnings of NumPy are off in the context.
    Raises CannotReadError where the file cannot be read, UnusableFileError where a check fails, and instead of a
    `DAMAGE_ERRORS` exception within the context."""
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
    except DAMAGE_ERRORS as problem:
        # h5py may raise these for damaged files; an UnusableFileError from above is none of them and passes.
        raise UnusableFileError(
            path, kind, (f"it is not HDF5 that can be read, or it is cut off ({problem})",)
        ) from problem
