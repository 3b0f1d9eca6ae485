"""Arrays of a file of which every column is needed."""

from pathlib import Path

from study.importing.arrays.csv_arrays import FaultyColumn
from study.importing.arrays.read_arrays import Arrays, find_unread_reason, read_arrays
from study.importing.map_format.import_map import CsvMap
from study.importing.map_format.map_errors import ImportRefusedError


def read_whole(path: Path, settings: CsvMap) -> Arrays:
    """As a map does that takes each of them. Raises ImportRefusedError."""
    found = read_arrays(path, settings)
    for array in found.by_name.values():
        if isinstance(problem := find_unread_reason(array), FaultyColumn):
            raise ImportRefusedError(path.name, problem)
    return found
