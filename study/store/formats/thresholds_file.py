"""`thresholds.csv`, and `detection.csv` for detection runs: one row per run, columns as the fields of
`analysis.psychophysics.thresholds.Threshold`."""

from collections.abc import Iterable
from pathlib import Path

from analysis.psychophysics.thresholds import Threshold
from study.store.disk.csv_rows import CsvError, columns, rows_from_csv, rows_to_csv
from study.store.disk.file_errors import UnusableFileError
from study.store.disk.text_file import read_text, write_text

THRESHOLDS_NAME = "thresholds.csv"
DETECTION_NAME = "detection.csv"
"""Table of detection thresholds; written only where there are detection runs."""
THRESHOLDS_HEADER = columns(Threshold)
"""Names of the columns, in their order."""
KIND = "table of thresholds"
"""What messages call such a file."""


def write_thresholds(path: Path, thresholds: Iterable[Threshold]) -> None:
    """Write the table; replaces an older one, since it can be recomputed. Raises CannotWriteError."""
    write_text(path, rows_to_csv(thresholds, Threshold), overwrite=True)


def read_thresholds(path: Path) -> tuple[Threshold, ...]:
    """Read the table. Raises CannotReadError, UnusableFileError."""
    try:
        return rows_from_csv(read_text(path), Threshold)
    except CsvError as error:
        raise UnusableFileError(path, KIND, error.problems) from error
