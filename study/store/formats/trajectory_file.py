"""Read and write trajectories as CSV files: desired accelerations (m/s²) or commanded forces (N) over time (s).

`equalizer.tracking.feedforward.trajectory` defines the tables and parses them; this module adds the file access.
"""

from pathlib import Path

from equalizer.tracking.feedforward.trajectory import TableError, Trajectory, parse_trajectory, trajectory_csv
from study.store.disk.file_errors import UnusableFileError
from study.store.disk.text_file import read_text, write_text


def read_trajectory(path: Path) -> Trajectory:
    """Read a table; its header determines its kind (`TABLE_KINDS`). Raises CannotReadError, and UnusableFileError for
    text that is not such a table."""
    try:
        return parse_trajectory(read_text(path))
    except TableError as error:
        raise UnusableFileError(path, "table of accelerations or forces", error.problems) from error


def write_trajectory(path: Path, trajectory: Trajectory) -> None:
    """Write the table of the trajectory's kind. Raises AlreadyThereError for an existing file, CannotWriteError, and
    TableError for missing samples."""
    write_text(path, trajectory_csv(trajectory), overwrite=False)
