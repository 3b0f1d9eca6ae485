"""Atomic writes: a file appears under its name complete and synced, or not at all."""

import os
import secrets
from contextlib import suppress
from pathlib import Path

from study.store.disk.file_errors import AlreadyThereError, CannotWriteError
from study.store.disk.privacy import file_mode


def write_atomically(path: Path, content: bytes, *, overwrite: bool = False) -> None:
    """Write beside the final name, sync, rename. Raises AlreadyThereError or CannotWriteError."""
    part = path.with_name(f".{path.name}.{secrets.token_hex(4)}.part")
    try:
        if path.exists() and not overwrite:
            raise AlreadyThereError(path)
        flags = os.O_WRONLY | os.O_CREAT | os.O_EXCL | getattr(os, "O_BINARY", 0)
        with os.fdopen(os.open(part, flags, file_mode(path.parent)), "wb") as file:
            file.write(content)
            file.flush()
            os.fsync(file.fileno())
        _move(part, path, overwrite)
        sync_folder(path.parent)
    except OSError as problem:
        raise CannotWriteError(path, problem) from problem
    finally:
        with suppress(OSError):
            part.unlink(missing_ok=True)


def sync_folder(folder: Path) -> None:
    """Sync the directory entry to the disk, where the system can."""
    if not hasattr(os, "O_DIRECTORY"):
        return
    descriptor = os.open(folder, os.O_RDONLY | os.O_DIRECTORY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)


def _move(part: Path, path: Path, overwrite: bool) -> None:
    if overwrite:
        part.replace(path)
        return
    try:
        # A link fails if the name was taken meanwhile; a rename would not.
        path.hardlink_to(part)
    except FileExistsError as problem:
        raise AlreadyThereError(path) from problem
    except OSError:
        # Some file systems (FAT, network shares) know no links.
        if path.exists():
            raise AlreadyThereError(path) from None
        part.replace(path)
