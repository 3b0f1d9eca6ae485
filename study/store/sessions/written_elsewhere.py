"""List of folders with results of a study that a withdrawal does not search, so that it can name them to the user.

Analyses, diagnoses and exports may be written to any folder (`--out`), but a withdrawal erases only within the data
folder, where the list is stored.
"""

import os
from contextlib import suppress
from pathlib import Path

from study.regular_file import MAX_DOCUMENT_BYTES, read_regular
from study.store.disk.atomic_write import sync_folder
from study.store.disk.privacy import PRIVATE_FILE
from study.store.disk.real_folder import is_real_file
from study.store.sessions.archive import holds_session

WRITTEN_ELSEWHERE_NAME = "written_elsewhere.txt"
"""Name of the file in the data folder; one absolute path per line."""
LINE_BREAK_REPLACEMENT = "\0"
"""Replaces a line break within a path; no path contains this character."""


def note_written_folder(source: Path, folder: Path, even_if_searched: bool = False) -> None:
    """Add the absolute path of `folder` to the list, unless it is listed already or a withdrawal would search or erase
    it: the data folder, a folder directly in it, or any folder within the session `source`. Errors of writing the list
    are ignored; a list that cannot be read is left as it is, so that its folders are not lost.

    source: the data folder, or a session folder in it. even_if_searched: add `folder` wherever it is, for content that
    a withdrawal does not recognise.
    """
    folder, source = folder.resolve(), source.resolve()
    data_folder = source.parent if holds_session(source) else source
    try:
        noted_folders = _read_list(data_folder)
    except OSError:
        return
    relative_parts = folder.relative_to(data_folder).parts if folder.is_relative_to(data_folder) else None
    is_searched = (
        not even_if_searched
        and relative_parts is not None
        and (len(relative_parts) < 2 or data_folder / relative_parts[0] == source)
    )
    if not is_searched and folder not in noted_folders:
        with suppress(OSError):
            # fsencode keeps the bytes of a name as the system has them: they need not be UTF-8.
            line = os.fsencode(str(folder).replace("\n", LINE_BREAK_REPLACEMENT) + "\n")
            _append_line(data_folder / WRITTEN_ELSEWHERE_NAME, line)


def read_written_folders(data_folder: Path) -> tuple[Path, ...]:
    """Read the listed folders, in the order in which they were added; empty if there are none or the list cannot be
    read."""
    try:
        return _read_list(data_folder)
    except OSError:
        return ()


def _append_line(list_path: Path, line: bytes) -> None:
    """Append a line with its end, on a line of its own, and sync it to the disk with the folder, in which the list may
    be new; a link in the place of the list is replaced. By appending, programs that export at the same time do not lose
    each other's lines. Raises OSError."""
    if list_path.is_symlink():
        list_path.unlink()
    with os.fdopen(os.open(list_path, os.O_RDWR | os.O_APPEND | os.O_CREAT, PRIVATE_FILE), "r+b", 0) as file:
        file.seek(max(0, file.seek(0, os.SEEK_END) - 1))
        file.write((b"" if file.read(1) in (b"", b"\n") else b"\n") + line)
        os.fsync(file.fileno())
    sync_folder(list_path.parent)


def _read_list(data_folder: Path) -> tuple[Path, ...]:
    """Read the listed folders; empty without a list, or with a link in its place. Raises OSError where the list cannot
    be read."""
    list_path = data_folder / WRITTEN_ELSEWHERE_NAME
    if not is_real_file(list_path):
        return ()
    lines = os.fsdecode(read_regular(list_path, MAX_DOCUMENT_BYTES)).split("\n")
    return tuple(Path(line.replace(LINE_BREAK_REPLACEMENT, "\n")) for line in lines if line)
