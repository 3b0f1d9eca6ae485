"""Read and write `reproduction.json`: published results and their reproduction (format `hapteq-reproduction`).

`analysis.evaluation.reproduction.document` defines and checks the content; this module adds the file, with format,
version and provenance.
"""

from pathlib import Path
from typing import Any

from analysis.evaluation.reproduction.document import (
    FORMAT,
    VERSION,
    Reproduction,
    ReproductionError,
    reproduction_from_json,
    reproduction_to_json,
)
from study.store.disk.file_errors import UnusableFileError
from study.store.disk.json_document import read_json, write_json
from study.store.disk.provenance import Provenance

REPRODUCTION_NAME = "reproduction.json"
"""Name of the file in the folder of an evaluation."""


def read_reproduction(path: Path) -> Reproduction:
    """Read the document, without its provenance. Raises CannotReadError where the file cannot be read,
    UnusableFileError where it has another format or version, or invalid content."""
    document: dict[str, Any] = read_json(path, FORMAT, VERSION)
    document.pop("provenance", None)
    try:
        return reproduction_from_json(document)
    except ReproductionError as error:
        raise UnusableFileError(path, "reproduction", error.problems) from error


def write_reproduction(path: Path, reproduction: Reproduction, provenance: Provenance | None = None) -> None:
    """Write the document, replacing an existing one. Raises CannotWriteError where it cannot be written."""
    write_json(path, FORMAT, VERSION, reproduction_to_json(reproduction), provenance, overwrite=True)
