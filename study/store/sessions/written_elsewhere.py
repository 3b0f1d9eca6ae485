"""Folders outside a data folder that contain its participants' numbers: noted, so that a withdrawal can name them."""

import os
from contextlib import suppress
from pathlib import Path

from study.regular_file import DOCUMENT_BYTES, read_regular
from study.store.disk.atomic_write import write_atomically
from study.store.disk.file_errors import CannotWriteError
from study.store.disk.real_folder import is_real_file
from study.store.sessions.archive import FOLDER

WRITTEN_ELSEWHERE = "written_elsewhere.txt"
"""File in the data folder with one path a line."""


def note_written(source: Path, out: Path, always: bool = False) -> None:
    """Note the absolute path of `out` if a withdrawal would not find it; always: it finds none of these.

    source: a data folder, or a session's in it. Read-only data are left unchanged.
    """
    out, source = out.resolve(), source.resolve()
    data = source.parent if FOLDER.fullmatch(source.name) else source
    known = folders_written_elsewhere(data)
    beside = out.relative_to(data).parts if out.is_relative_to(data) else None
    found = not always and beside is not None and (len(beside) < 2 or FOLDER.fullmatch(beside[0]) is not None)
    if found or out in known:
        return
    text = "".join(f"{path}\n" for path in (*known, out))
    with suppress(CannotWriteError):  # names as the system has them, which need not be UTF-8
        write_atomically(data / WRITTEN_ELSEWHERE, os.fsencode(text), overwrite=True)


def folders_written_elsewhere(data: Path) -> tuple[Path, ...]:
    """The noted folders; empty if nothing was noted, or the note cannot be read."""
    note = data / WRITTEN_ELSEWHERE
    if not is_real_file(note):
        return ()
    try:
        return tuple(Path(line) for line in os.fsdecode(read_regular(note, DOCUMENT_BYTES)).split("\n") if line)
    except OSError:
        return ()
