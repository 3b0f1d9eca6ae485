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


def require_new_folder(out: Path) -> None:
    """Raise StudyError unless `out` is new or an empty folder, and its parent exists and is writable (otherwise
    CannotWriteError, a StudyError)."""
    try:
        empty, there, inside = out.is_dir() and not any(out.iterdir()), out.exists(), out.absolute().parent.is_dir()
    except OSError as problem:
        raise CannotWriteError(out, problem) from problem
    if inside and not os.access(out.absolute().parent, os.W_OK):
        raise CannotWriteError(out, PermissionError(errno.EACCES, os.strerror(errno.EACCES)))
    if empty:
        return
    if there:
        what = "holds files already" if out.is_dir() else "is a file"
        raise StudyError(
            "The results need a folder of their own",
            f"{out} {what}, and results are never mixed or overwritten.",
            "Choose another name with --out, or empty it.",
            saved="Nothing was written.",
        )
    if not inside:
        raise StudyError(
            "The results need a folder of their own",
            f"There is no folder {out.parent} to make {out.name} in.",
            "Make it first, or choose another name with --out.",
            saved="Nothing was written.",
        )


@contextmanager
def new_folder(out: Path) -> Iterator[Path]:
    """A temporary folder that is renamed to `out` at the end; on an exception it is removed. Raises StudyError as
    `require_new_folder`, and CannotWriteError."""
    require_new_folder(out)
    part = out.absolute().with_name(f".{out.absolute().name}.{secrets.token_hex(4)}.part")
    try:
        make_folder(part)
    except OSError as problem:
        raise CannotWriteError(out, problem) from problem
    try:
        yield part
        require_new_folder(out)
        try:
            sync_folder(part)
            part.rename(out.absolute())
            sync_folder(out.absolute().parent)
        except OSError as problem:
            raise CannotWriteError(out, problem) from problem
    finally:
        shutil.rmtree(part, ignore_errors=True)
