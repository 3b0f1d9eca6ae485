"""Create a result folder atomically: it appears complete or not at all, and is never mixed with existing files.

The results are written into a hidden temporary folder in the same parent folder, which is renamed at the end.
"""

import errno
import os
import secrets
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from study.errors import StudyError
from study.store.disk.atomic_write import sync_entry, sync_folder
from study.store.disk.file_errors import CannotWriteError, convert_write_errors
from study.store.disk.privacy import make_folder


def require_new_folder(folder: Path) -> None:
    """Check that results can be written to `folder`. Raises StudyError where it exists and is not an empty folder, or
    where its parent does not exist; CannotWriteError, a StudyError, where the parent is not writable, the folder is a
    link that leads in a circle, or the folder or its parent cannot be examined."""
    with convert_write_errors(folder):
        if _follow_links(folder).is_symlink():
            raise OSError(errno.ELOOP, os.strerror(errno.ELOOP))
        parent = _follow_links(folder).parent
        is_empty, exists, has_parent = (
            folder.is_dir() and not any(folder.iterdir()),
            folder.exists(),
            parent.is_dir(),
        )
    if has_parent and not os.access(parent, os.W_OK):
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
            f"There is no folder {parent if folder.is_symlink() else folder.parent} to make {folder.name} in.",
            "Make it first, or choose another name with --out.",
            saved="Nothing was written.",
        )


@contextmanager
def create_new_folder(folder: Path) -> Iterator[Path]:
    """Yield a temporary folder for the results, which is renamed to `folder`, or to where a link of this name leads, at
    the end of the context; after an exception in the context it is removed. Raises StudyError as `require_new_folder`
    does, at the beginning and before renaming, CannotWriteError where a folder cannot be created, synced or renamed,
    and NotSyncedError where only the folder that holds it cannot be synced."""
    require_new_folder(folder)
    folder = _follow_links(folder)
    temporary_folder = folder.with_name(f".{folder.name}.{secrets.token_hex(4)}.part")
    with convert_write_errors(folder):
        make_folder(temporary_folder)
    try:
        yield temporary_folder
        require_new_folder(folder)
        with convert_write_errors(folder):
            sync_folder(temporary_folder)
            temporary_folder.rename(folder)
        sync_entry(folder)
    finally:
        shutil.rmtree(temporary_folder, ignore_errors=True)


def _follow_links(folder: Path) -> Path:
    """Return the absolute path to which a path leads; a link that leads in a circle is returned as it is."""
    return Path(os.path.realpath(folder))
