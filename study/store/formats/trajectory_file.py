"""Wanted accelerations and the corresponding forces, as CSV."""

from pathlib import Path

from equalizer.tracking.feedforward.trajectory import TableError, Trajectory, parse_trajectory, trajectory_csv
from study.store.disk.file_errors import UnusableFileError
from study.store.disk.text_file import read_text, write_text


def read_trajectory(path: Path) -> Trajectory:
    """Read a table of either kind, distinguished by its header. Raises CannotReadError, UnusableFileError."""
    try:
        return parse_trajectory(read_text(path))
    except TableError as error:
        raise UnusableFileError(path, "table of accelerations or forces", error.problems) from error


def write_trajectory(path: Path, trajectory: Trajectory) -> None:
    """Write either kind. Raises AlreadyThereError, CannotWriteError; TableError for missing samples."""
    write_text(path, trajectory_csv(trajectory), overwrite=False)
