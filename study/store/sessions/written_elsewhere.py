"""List of folders with results of a study that a withdrawal does not search, so that it can name them to the user.

Analyses and exports may be written to any folder (`--out`). A withdrawal erases only within the data folder; each other
folder is noted in a text file there when it is written.
"""

import os
from contextlib import suppress
from pathlib import Path

from study.regular_file import MAX_DOCUMENT_BYTES, read_regular
from study.store.disk.atomic_write import write_atomically
from study.store.disk.file_errors import CannotWriteError
from study.store.disk.real_folder import is_real_file
from study.store.sessions.archive import FOLDER_PATTERN

WRITTEN_ELSEWHERE = "written_elsewhere.txt"
"""Name of the file in the data folder; one absolute path per line."""
LINE_BREAK = "\0"
"""Replaces a line break within a path; no path contains this character."""


def note_written_folder(source: Path, folder: Path, always: bool = False) -> None:
    """Note the absolute path of `folder`, unless it is noted already or a withdrawal would search it: the data folder,
    a folder directly in it, or any folder within a session. A data folder that cannot be written to stays as it is.

    source: the data folder, or a session folder in it. always: note `folder` wherever it is, for
    an export, which a withdrawal does not find.
    """
    folder, source = folder.resolve(), source.resolve()
    data = source.parent if FOLDER_PATTERN.fullmatch(source.name) else source
    noted = read_written_folders(data)
    relative_parts = folder.relative_to(data).parts if folder.is_relative_to(data) else None
    is_searched = (
        not always
        and relative_parts is not None
        and (len(relative_parts) < 2 or FOLDER_PATTERN.fullmatch(relative_parts[0]) is not None)
    )
    if is_searched or folder in noted:
        return
    text = "".join(str(path).replace("\n", LINE_BREAK) + "\n" for path in (*noted, folder))
    with suppress(CannotWriteError):
        # fsencode keeps the bytes of a name as the system has them: they need not be UTF-8.
        write_atomically(data / WRITTEN_ELSEWHERE, os.fsencode(text), overwrite=True)


def read_written_folders(data: Path) -> tuple[Path, ...]:
    """The noted folders, in the order in which they were noted; empty if there are none or the list cannot be read."""
    note = data / WRITTEN_ELSEWHERE
    if not is_real_file(note):
        return ()
    try:
        lines = os.fsdecode(read_regular(note, MAX_DOCUMENT_BYTES)).split("\n")
    except OSError:
        return ()
    return tuple(Path(line.replace(LINE_BREAK, "\n")) for line in lines if line)
