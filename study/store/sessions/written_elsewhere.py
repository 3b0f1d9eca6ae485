"""List of folders with results of a study that a withdrawal does not search, so that it can name them to the user.

Analyses, diagnoses and exports may be written to any folder (`--out`), but a withdrawal erases only within the data
folder, where the list is stored.
"""

import os
from contextlib import suppress
from pathlib import Path

from study.regular_file import MAX_DOCUMENT_BYTES, read_regular
from study.store.disk.atomic_write import write_atomically
from study.store.disk.file_errors import CannotWriteError, NotSyncedError
from study.store.disk.real_folder import is_real_file
from study.store.sessions.archive import FOLDER_PATTERN

WRITTEN_ELSEWHERE_NAME = "written_elsewhere.txt"
"""Name of the file in the data folder; one absolute path per line."""
LINE_BREAK_REPLACEMENT = "\0"
"""Replaces a line break within a path; no path contains this character."""


def note_written_folder(source: Path, folder: Path, even_if_searched: bool = False) -> None:
    """Add the absolute path of `folder` to the list, unless it is listed already or a withdrawal would search it: the
    data folder, a folder directly in it, or any folder within a session. Errors of writing the list are ignored; a
    list that cannot be read is left as it is, so that its folders are not lost.

    source: the data folder, or a session folder in it. even_if_searched: add `folder` wherever it is, for content that
    a withdrawal does not recognise.
    """
    folder, source = folder.resolve(), source.resolve()
    data_folder = source.parent if FOLDER_PATTERN.fullmatch(source.name) else source
    try:
        noted_folders = _read_list(data_folder)
    except OSError:
        return
    relative_parts = folder.relative_to(data_folder).parts if folder.is_relative_to(data_folder) else None
    is_searched = (
        not even_if_searched
        and relative_parts is not None
        and (len(relative_parts) < 2 or FOLDER_PATTERN.fullmatch(relative_parts[0]) is not None)
    )
    if is_searched or folder in noted_folders:
        return
    text = "".join(str(path).replace("\n", LINE_BREAK_REPLACEMENT) + "\n" for path in (*noted_folders, folder))
    with suppress(CannotWriteError, NotSyncedError):
        # fsencode keeps the bytes of a name as the system has them: they need not be UTF-8.
        write_atomically(data_folder / WRITTEN_ELSEWHERE_NAME, os.fsencode(text), overwrite=True)


def read_written_folders(data_folder: Path) -> tuple[Path, ...]:
    """Read the listed folders, in the order in which they were added; empty if there are none or the list cannot be
    read."""
    try:
        return _read_list(data_folder)
    except OSError:
        return ()


def _read_list(data_folder: Path) -> tuple[Path, ...]:
    """Read the listed folders; empty without a list, or with a link in its place. Raises OSError where the list cannot
    be read."""
    list_path = data_folder / WRITTEN_ELSEWHERE_NAME
    if not is_real_file(list_path):
        return ()
    lines = os.fsdecode(read_regular(list_path, MAX_DOCUMENT_BYTES)).split("\n")
    return tuple(Path(line.replace(LINE_BREAK_REPLACEMENT, "\n")) for line in lines if line)
