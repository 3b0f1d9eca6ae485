"""Atomic writes: a file appears under its final name complete and synced to disk, or not at all."""

import errno
import os
import secrets
import shutil
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from study.store.disk.file_errors import AlreadyExistsError, CannotWriteError, NotSyncedError, convert_write_errors
from study.store.disk.privacy import choose_file_mode


def write_atomically(path: Path, content: bytes, *, overwrite: bool = False) -> None:
    """Write `content` to a temporary file in the same folder, sync it, and move it to `path`; its mode is
    `privacy.choose_file_mode`. overwrite: replace an existing file. Raises AlreadyExistsError if the file exists and is
    not to be replaced, CannotWriteError for an error of the operating system, NotSyncedError where the file is in place
    and only the sync of the folder failed. After an error the temporary file is removed."""
    temporary_path = _name_temporary(path)
    try:
        if path.exists() and not overwrite:
            raise AlreadyExistsError(path)
        open_flags = os.O_WRONLY | os.O_CREAT | os.O_EXCL | getattr(os, "O_BINARY", 0)
        with os.fdopen(os.open(temporary_path, open_flags, choose_file_mode(path.parent)), "wb") as file:
            file.write(content)
            file.flush()
            os.fsync(file.fileno())
        _move_into_place(temporary_path, path, overwrite)
    except OSError as problem:
        raise CannotWriteError(path, problem) from problem
    finally:
        with suppress(OSError):
            temporary_path.unlink(missing_ok=True)
    sync_entry(path)


@contextmanager
def reserve_space(path: Path, size_bytes: int) -> Iterator[None]:
    """Context that keeps `size_bytes` (at least 1) of the disk free for `write_atomically(path, ...)` after it, in a
    temporary file. Raises CannotWriteError before the body where they are not free, or no file can be made there. Where
    the system reserves no space (macOS, Windows), the free space is only compared."""
    temporary_path = _name_temporary(path)
    descriptor = -1
    try:
        with convert_write_errors(path):
            descriptor = os.open(temporary_path, os.O_WRONLY | os.O_CREAT | os.O_EXCL, choose_file_mode(path.parent))
            with suppress(OSError):  # without a name nothing remains of it, however the program ends (not on Windows)
                temporary_path.unlink()
            _allocate(descriptor, path.absolute().parent, size_bytes)
        yield
    finally:
        if descriptor >= 0:
            os.close(descriptor)
        with suppress(OSError):
            temporary_path.unlink(missing_ok=True)


def _allocate(descriptor: int, folder: Path, size_bytes: int) -> None:
    """Allocate `size_bytes` for an open file of the folder, or compare them with the free space where the system cannot
    allocate. Raises OSError."""
    if hasattr(os, "posix_fallocate"):
        try:
            os.posix_fallocate(descriptor, 0, size_bytes)
        except OSError as problem:
            if problem.errno not in (errno.EINVAL, errno.EOPNOTSUPP):
                raise
        else:
            return
    if shutil.disk_usage(folder).free < size_bytes:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))


def _name_temporary(path: Path) -> Path:
    """Make a new name for the temporary file that becomes `path`."""
    return path.with_name(f".{path.name}.{secrets.token_hex(4)}.part")


def sync_entry(path: Path) -> None:
    """Sync the folder that holds a complete file or folder. Raises NotSyncedError where it cannot be synced."""
    try:
        sync_folder(path.absolute().parent)
    except OSError as problem:
        raise NotSyncedError(path, problem) from problem


def sync_folder(folder: Path) -> None:
    """Sync the entries of a folder to the disk, so that created and renamed files survive a power failure; nothing on
    systems that cannot open folders (Windows). Raises OSError where the folder cannot be opened or synced."""
    if not hasattr(os, "O_DIRECTORY"):
        return
    descriptor = os.open(folder, os.O_RDONLY | os.O_DIRECTORY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)


def _move_into_place(temporary_path: Path, path: Path, overwrite: bool) -> None:
    """Move the complete file to `path`. Without `overwrite`, raises AlreadyExistsError if `path` exists; on file
    systems without hard links, a file that another program creates between the check and the move is replaced. Other
    errors are OSError."""
    if overwrite:
        temporary_path.replace(path)
        return
    try:
        # Creating a hard link fails if another program has created the file in the meantime; a rename would replace it.
        path.hardlink_to(temporary_path)
    except FileExistsError as problem:
        raise AlreadyExistsError(path) from problem
    except OSError:
        # Some file systems (FAT, network shares) do not support hard links.
        if path.exists():
            raise AlreadyExistsError(path) from None
        temporary_path.replace(path)
