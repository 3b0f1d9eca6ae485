"""Result folders that appear complete or not at all.

The results are written into a hidden temporary folder beside the final place, which is synced and renamed at the end.
Results are never mixed with existing files.
"""

import errno
import os
import secrets
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from study.errors import StudyError
from study.store.disk.atomic_write import sync_folder
from study.store.disk.file_errors import CannotWriteError
from study.store.disk.privacy import make_folder


def require_new_folder(folder: Path) -> None:
    """Raise StudyError unless `folder` is new or an empty folder, and its parent exists and is writable (otherwise
    CannotWriteError, a StudyError)."""
    try:
        is_empty, exists, has_parent = (
            folder.is_dir() and not any(folder.iterdir()),
            folder.exists(),
            folder.absolute().parent.is_dir(),
        )
    except OSError as problem:
        raise CannotWriteError(folder, problem) from problem
    if has_parent and not os.access(folder.absolute().parent, os.W_OK):
        raise CannotWriteError(folder, PermissionError(errno.EACCES, os.strerror(errno.EACCES)))
    if is_empty:
        return
    if exists:
        reason = "holds files already" if folder.is_dir() else "is a file"
        raise StudyError(
            "The results need a folder of their own",
            f"{folder} {reason}, and results are never mixed or overwritten.",
            "Choose another name with --out, or empty it.",
            saved="Nothing was written.",
        )
    if not has_parent:
        raise StudyError(
            "The results need a folder of their own",
            f"There is no folder {folder.parent} to make {folder.name} in.",
            "Make it first, or choose another name with --out.",
            saved="Nothing was written.",
        )


@contextmanager
def new_folder(folder: Path) -> Iterator[Path]:
    """A temporary folder that is renamed to `folder` at the end; on an exception it is removed. Raises StudyError as
    `require_new_folder`, and CannotWriteError."""
    require_new_folder(folder)
    part = folder.absolute().with_name(f".{folder.absolute().name}.{secrets.token_hex(4)}.part")
    try:
        make_folder(part)
    except OSError as problem:
        raise CannotWriteError(folder, problem) from problem
    try:
        yield part
        require_new_folder(folder)
        try:
            sync_folder(part)
            part.rename(folder.absolute())
            sync_folder(folder.absolute().parent)
        except OSError as problem:
            raise CannotWriteError(folder, problem) from problem
    finally:
        shutil.rmtree(part, ignore_errors=True)
