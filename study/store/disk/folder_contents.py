"""Read the files of a folder into memory, and write them to another folder: transfer between processes without a
common disk."""

from collections.abc import Mapping
from pathlib import Path

from study.store.disk.file_errors import CannotReadError, convert_write_errors
from study.store.disk.privacy import make_folder, write_private

FileContents = dict[str, bytes]
"""Content of each file, by its path relative to the folder, with forward slashes."""


def read_files(folder: Path) -> FileContents:
    """Read the files below the folder; empty for a folder that is empty or missing. Links to files are followed, links
    to folders are not; subfolders without read permission are skipped. Raises CannotReadError where a file cannot be
    read."""
    try:
        paths = sorted(path for path in folder.rglob("*") if path.is_file())
        return {path.relative_to(folder).as_posix(): path.read_bytes() for path in paths}
    except OSError as problem:
        raise CannotReadError(folder, problem) from problem


def read_file(path: Path) -> FileContents:
    """Read a single file; its key is its name without folders. Raises CannotReadError."""
    try:
        return {path.name: path.read_bytes()}
    except OSError as problem:
        raise CannotReadError(path, problem) from problem


def write_files(folder: Path, files: Mapping[str, bytes]) -> None:
    """Write the files below the folder, new ones with mode 600, replacing the content of existing ones; missing folders
    are created. The keys are not checked (`..` leaves the folder): they must come from a trusted sender. Raises
    CannotWriteError where a file cannot be written; those before it remain."""
    with convert_write_errors(folder):
        for name, content in files.items():
            make_folder((folder / name).parent)
            write_private(folder / name, content)
