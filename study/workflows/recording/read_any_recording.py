"""Read a recording from any file: hapteq's own format directly, other formats by an import in memory.

A file of another program (table, MATLAB, NumPy, …) is imported without an import map, which requires that its names
state the roles of the channels.
"""

from pathlib import Path

from equalizer.signals.recording import Recording
from study.errors import StudyError
from study.store.disk.hdf5_file import is_hdf5, read_format
from study.store.formats.recording_file import read_recording

HAPTEQ_PREFIX = "hapteq"
"""Beginning of the names of hapteq's formats; a file of another program may state a format, too."""


def read_any_recording(path: Path) -> tuple[Recording, tuple[str, ...]]:
    """Read a recording, and return it with the remarks on its import (none for a hapteq recording). Raises StudyError
    where the file cannot be read, is invalid, or can only be imported with an import map."""
    if path.is_file() and is_hdf5(path) and read_format(path).startswith(HAPTEQ_PREFIX):
        return read_recording(path), ()
    # Imported here, because these modules take longer to load than a hapteq recording to read.
    from study.importing.arrays.read_arrays import FOREIGN_ENDINGS
    from study.importing.map_format.map_errors import MapNeededError
    from study.workflows.recording.import_recording import read_foreign

    if path.suffix.lower() not in FOREIGN_ENDINGS and not (path.is_file() and is_hdf5(path)):
        return read_recording(path), ()
    try:
        foreign_recording = read_foreign((path,), None)
    except MapNeededError as map_error:
        raise StudyError(
            map_error.title,
            map_error.happened,
            f"hapteq import {path} --out REC.h5 > MAP.toml prints one: complete it, import with --map MAP.toml, and "
            "give REC.h5.",
        ) from map_error
    return foreign_recording.recording, (
        f"{path.name} is no hapteq recording: it was imported in memory.",
        *foreign_recording.notes,
    )
