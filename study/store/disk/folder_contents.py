"""Contents of a folder as values, to be sent to or from another process that may not share a disk.

Used where work on many folders is distributed over processes (evaluations, rehearsals of a study).
"""

from collections.abc import Mapping
from pathlib import Path

from study.store.disk.file_errors import CannotReadError, CannotWriteError
from study.store.disk.privacy import make_folder, write_private

Files = dict[str, bytes]
"""Content of each file, by its path relative to the folder, with forward slashes."""


def read_files(folder: Path) -> Files:
    """All regular files below the folder; a link to a regular file is read as that file. Raises CannotReadError."""
    try:
        paths = sorted(path for path in folder.rglob("*") if path.is_file())
        return {path.relative_to(folder).as_posix(): path.read_bytes() for path in paths}
    except OSError as problem:
        raise CannotReadError(folder, problem) from problem


def read_file(path: Path) -> Files:
    """The content of a single file, under its name without folders. Raises CannotReadError."""
    try:
        return {path.name: path.read_bytes()}
    except OSError as problem:
        raise CannotReadError(path, problem) from problem


def write_files(folder: Path, files: Mapping[str, bytes]) -> None:
    """Write the files below the folder, and replace existing ones; missing folders are made. The paths are not checked:
    they must come from a trusted sender. Raises CannotWriteError."""
    try:
        for name, content in files.items():
            make_folder((folder / name).parent)
            write_private(folder / name, content)
    except OSError as problem:
        raise CannotWriteError(folder, problem) from problem
