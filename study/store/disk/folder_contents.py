"""The files of a folder as values, to be sent to another process that may not share a disk, or back from it."""

from collections.abc import Mapping
from pathlib import Path

from study.store.disk.file_errors import CannotReadError, CannotWriteError
from study.store.disk.privacy import make_folder, write_private

Files = dict[str, bytes]
"""Content by the path relative to the folder, with forward slashes."""


def read_files(folder: Path) -> Files:
    """All regular files below the folder, and what links to such files lead to. Raises CannotReadError."""
    try:
        paths = sorted(path for path in folder.rglob("*") if path.is_file())
        return {path.relative_to(folder).as_posix(): path.read_bytes() for path in paths}
    except OSError as problem:
        raise CannotReadError(folder, problem) from problem


def read_file(path: Path) -> Files:
    """A single file, by its name. Raises CannotReadError."""
    try:
        return {path.name: path.read_bytes()}
    except OSError as problem:
        raise CannotReadError(path, problem) from problem


def write_files(folder: Path, files: Mapping[str, bytes]) -> None:
    """Write them below the folder, which is made where it is missing. Raises CannotWriteError."""
    try:
        for name, content in files.items():
            make_folder((folder / name).parent)
            write_private(folder / name, content)
    except OSError as problem:
        raise CannotWriteError(folder, problem) from problem
