"""Read a recording from any file: a hapteq recording directly; a file of another program (table, MATLAB, NumPy, …) by
an import in memory, without an import map, where its names state the roles of the channels."""

from pathlib import Path

from equalizer.signals.recording import Recording
from study.errors import StudyError
from study.store.disk.hdf5_file import is_hdf5, read_format
from study.store.formats.recording_file import read_recording


def read_any_recording(path: Path) -> tuple[Recording, tuple[str, ...]]:
    """The recording in a file, and remarks on its import (empty for a hapteq recording). Raises StudyError where the
    file cannot be read, or where it can only be imported with an import map."""
    if path.is_file() and is_hdf5(path) and read_format(path):
        return read_recording(path), ()
    # Imported here, because loading the import takes longer than reading a hapteq recording.
    from study.importing.arrays.arrays import FOREIGN
    from study.importing.map_format.map_errors import MapNeededError
    from study.workflows.recording.import_recording import read_foreign

    if path.suffix.lower() not in FOREIGN and not (path.is_file() and is_hdf5(path)):
        return read_recording(path), ()
    try:
        imported = read_foreign((path,), None)
    except MapNeededError as needed:
        raise StudyError(
            needed.title,
            needed.happened,
            f"hapteq import {path} --out REC.h5 > MAP.toml prints one: complete it, import with --map MAP.toml, and "
            "give REC.h5.",
        ) from needed
    return imported.recording, (f"{path.name} is no hapteq recording: it was imported in memory.", *imported.notes)
