"""Read and write tables of thresholds: `thresholds.csv`, and `detection.csv` for detection runs.

One row per run. The columns are the fields of `analysis.psychophysics.thresholds.Threshold`, which states how each is
computed; units are part of the names (`_n`: newtons, `_db`: dB re 1 N).
"""

from collections.abc import Iterable
from pathlib import Path

from analysis.psychophysics.thresholds import Threshold
from study.store.disk.csv_rows import format_csv_table, list_columns, parse_csv_table
from study.store.disk.file_errors import convert_problems
from study.store.disk.text_file import read_text, write_text

THRESHOLDS_NAME = "thresholds.csv"
"""Table of direction thresholds."""
DETECTION_NAME = "detection.csv"
"""Table of detection thresholds, written only if there are detection runs."""
THRESHOLDS_HEADER = list_columns(Threshold)
"""Names of the columns, in order."""
KIND = "table of thresholds"
"""Name of this kind of file in error messages."""


def write_thresholds(path: Path, thresholds: Iterable[Threshold]) -> None:
    """Write the table. An existing table is replaced, because it can be recomputed from the trials. Raises
    CannotWriteError."""
    write_text(path, format_csv_table(thresholds, Threshold), overwrite=True)


def read_thresholds(path: Path) -> tuple[Threshold, ...]:
    """Read the table. Raises CannotReadError where the file cannot be read, UnusableFileError where it is not a table
    of thresholds."""
    with convert_problems(path, KIND):
        return parse_csv_table(read_text(path), Threshold)
