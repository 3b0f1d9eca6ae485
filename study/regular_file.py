"""Open and read regular files only; for a pipe, a device or a folder an error is raised at once, without blocking."""

import errno
import io
import os
import stat
from pathlib import Path

MAX_TABLE_BYTES = 2**28
"""Largest text that is read (tables, logs), in bytes. Chosen: an hour at 1 kHz with four columns of 17 digits."""
MAX_DOCUMENT_BYTES = 2**24
"""Largest JSON or TOML document that is read, in bytes. Chosen: the largest that hapteq writes are below 1 MB."""

_BLOCK_BYTES = 2**20
"""Number of bytes that are read at once."""
_SPECIAL_FILE_TESTS = (
    (stat.S_ISFIFO, "it is a pipe, not a file"),
    (stat.S_ISSOCK, "it is a socket, not a file"),
    (stat.S_ISCHR, "it is a device, not a file"),
    (stat.S_ISBLK, "it is a device, not a file"),
)
"""Tests of the mode of a file, and the reason of the error for each."""


class RefusedFileError(OSError):
    """A file that the system could read but hapteq refuses: not regular, or too large. An OSError, so that it is
    handled like any file that cannot be opened. error_number: of `errno`; reason: a sentence without capital letter and
    full stop."""

    def __init__(self, error_number: int, reason: str) -> None:
        super().__init__(error_number, reason)
        self.reason = reason


def open_regular(path: Path) -> io.BufferedReader:
    """Open a regular file for reading; symbolic links are followed. Raises OSError; of its kinds, IsADirectoryError for
    a folder and RefusedFileError for anything else that is no regular file."""
    _require_regular(path.stat())  # first, because opening some devices has side effects
    flags = os.O_RDONLY | getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_NOCTTY", 0) | getattr(os, "O_BINARY", 0)
    descriptor = os.open(path, flags)
    try:
        _require_regular(os.fstat(descriptor))  # again, because the name may refer to another file by now
        return os.fdopen(descriptor, "rb")
    except BaseException:
        os.close(descriptor)
        raise


def read_regular(path: Path, max_bytes: int = MAX_TABLE_BYTES) -> bytes:
    """Read the whole content of a regular file. Raises as `open_regular`, and RefusedFileError for a file of more than
    `max_bytes`."""
    with open_regular(path) as file:
        size = os.fstat(file.fileno()).st_size
        blocks: list[bytes] = []
        byte_count = 0
        # The stated size is not sufficient: a system file may state 0 bytes and have no end.
        while size <= max_bytes and byte_count <= max_bytes and (block := file.read(_BLOCK_BYTES)):
            blocks.append(block)
            byte_count += len(block)
    if max(size, byte_count) > max_bytes:
        raise RefusedFileError(errno.EFBIG, f"it has {max(size, byte_count)} bytes, and up to {max_bytes} are read")
    return b"".join(blocks)


def _require_regular(status: os.stat_result) -> None:
    """Raise IsADirectoryError for a folder, RefusedFileError for anything else that is not a regular file."""
    if stat.S_ISDIR(status.st_mode):
        raise IsADirectoryError(errno.EISDIR, os.strerror(errno.EISDIR))
    if not stat.S_ISREG(status.st_mode):
        reason = next(
            (special_reason for is_kind, special_reason in _SPECIAL_FILE_TESTS if is_kind(status.st_mode)),
            "it is no regular file",
        )
        raise RefusedFileError(errno.EINVAL, reason)
