"""`reproduction.json`: the format `hapteq-reproduction`, version 1."""

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


def read_reproduction(path: Path) -> Reproduction:
    """Read the document. Raises CannotReadError, UnusableFileError."""
    document: dict[str, Any] = read_json(path, FORMAT, VERSION)
    document.pop("provenance", None)
    try:
        return reproduction_from_json(document)
    except ReproductionError as error:
        raise UnusableFileError(path, "reproduction", error.problems) from error


def write_reproduction(path: Path, reproduction: Reproduction, provenance: Provenance | None = None) -> None:
    """Write the document, replacing an existing one. Raises CannotWriteError."""
    write_json(path, FORMAT, VERSION, reproduction_to_json(reproduction), provenance, overwrite=True)
