"""Read and write trajectories as CSV files: desired accelerations (m/s²) or commanded forces (N) over time (s).

`equalizer.tracking.feedforward.trajectory` defines and parses the tables; this module adds the file access.
"""

from pathlib import Path

from equalizer.tracking.feedforward.trajectory import Trajectory, format_trajectory_csv, parse_trajectory
from study.store.disk.file_errors import convert_problems
from study.store.disk.text_file import read_text, write_text


def read_trajectory(path: Path) -> Trajectory:
    """Read a table; its header determines whether it holds accelerations or forces (`TABLE_KINDS`). Raises
    CannotReadError where the file cannot be read as text, UnusableFileError where the text is no such table."""
    with convert_problems(path, "table of accelerations or forces"):
        return parse_trajectory(read_text(path))


def write_trajectory(path: Path, trajectory: Trajectory) -> None:
    """Write the table of the trajectory's kind. Raises TableError for NaN or infinite samples, AlreadyExistsError where
    the file exists, CannotWriteError where it cannot be written."""
    write_text(path, format_trajectory_csv(trajectory), overwrite=False)
