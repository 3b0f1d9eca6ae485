"""Check a recording of others, such as a table or a workbook, as an import would read it."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from analysis.look.driven_band import silent_segments
from study.errors import StudyError
from study.importing.arrays.arrays import FOREIGN, HDF5, RECORDS, TABLES
from study.store.disk.hdf5_file import format_of, is_hdf5
from study.workflows.files.recognisers import describe_recording


@dataclass(frozen=True, slots=True)
class ForeignCheck:
    kind: str
    problems: tuple[str, ...]
    notes: tuple[str, ...]


def is_foreign(path: Path) -> bool:
    """Whether a file is of a kind in which nothing of ours is stored."""
    return path.suffix.lower() in FOREIGN and path.suffix.lower() not in (*TABLES, *RECORDS) and path.is_file()


def may_be_foreign(path: Path) -> bool:
    """Of a file in which nothing of ours was found."""
    return path.suffix.lower() in (*FOREIGN, *HDF5) and path.is_file() and not (is_hdf5(path) and format_of(path))


def check_foreign(files: Sequence[Path]) -> ForeignCheck:
    """Never raises for the content of the files."""
    # Here, for the import takes longer to load than most files take to be checked.
    from study.workflows.recording.import_recording import read_foreign

    try:
        found = read_foreign(files, None)
    except StudyError as refused:
        return ForeignCheck("recording of others", (f"{refused.title}: {refused.happened}",), ())
    return ForeignCheck(
        f"recording of others, {describe_recording(found.recording)}", silent_segments(found.recording), found.notes
    )
