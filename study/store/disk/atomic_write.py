"""Atomic writes: a file appears under its final name complete and synced to disk, or not at all."""

import os
import secrets
from contextlib import suppress
from pathlib import Path

from study.store.disk.file_errors import AlreadyExistsError, CannotWriteError, NotSyncedError
from study.store.disk.privacy import choose_file_mode


def write_atomically(path: Path, content: bytes, *, overwrite: bool = False) -> None:
    """Write `content` to a temporary file in the same folder, sync it, and move it to `path`; its mode is
    `privacy.choose_file_mode`. overwrite: replace an existing file. Raises AlreadyExistsError if the file exists and is
    not to be replaced, CannotWriteError for an error of the operating system, NotSyncedError where the file is in place
    and only the sync of the folder failed. After an error the temporary file is removed."""
    temporary_path = path.with_name(f".{path.name}.{secrets.token_hex(4)}.part")
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
