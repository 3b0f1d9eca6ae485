"""Read and write `reproduction.json`: published results and their reproduction (format `hapteq-reproduction`).

`analysis.evaluation.reproduction.document` defines and checks the content; this module adds the file, with format,
version and provenance.
"""

from pathlib import Path

from analysis.evaluation.reproduction.document import (
    FORMAT,
    VERSION,
    Reproduction,
    reproduction_from_json,
    reproduction_to_json,
)
from study.store.disk.json_document import read_content, write_json
from study.store.disk.provenance import Provenance

REPRODUCTION_NAME = "reproduction.json"
"""Name of the file in the folder of an evaluation."""


def read_reproduction(path: Path) -> Reproduction:
    """Read the document, without its provenance. Raises CannotReadError where the file cannot be read,
    UnusableFileError where it has another format or version, or invalid content."""
    return read_content(path, FORMAT, VERSION, "reproduction", reproduction_from_json)


def write_reproduction(path: Path, reproduction: Reproduction, provenance: Provenance | None = None) -> None:
    """Write the document, replacing an existing one. Raises CannotWriteError where it cannot be written."""
    write_json(path, FORMAT, VERSION, reproduction_to_json(reproduction), provenance, overwrite=True)
