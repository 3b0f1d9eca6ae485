"""Result of a diagnosis of missing physics, `diagnosis.json`: the format `hapteq-diagnosis`, version 1.

This module reads and writes the file; `analysis.diagnosis.document` defines and checks its content.
"""

from pathlib import Path

from analysis.diagnosis.document import FORMAT, VERSION, Diagnosis, diagnosis_from_json, diagnosis_to_json
from study.store.disk.json_document import read_content, write_json
from study.store.disk.provenance import Provenance

DIAGNOSIS_NAME, MODEL_NAME, PAGE_NAME = "diagnosis.json", "improved.toml", "report.html"
"""Names of the files in the folder of a diagnosis: the result, the improved model, and the report."""


def read_diagnosis(path: Path) -> Diagnosis:
    """Read a diagnosis, without its provenance. Raises CannotReadError where the file cannot be read, UnusableFileError
    where it has another format or version, or invalid content."""
    return read_content(path, FORMAT, VERSION, "diagnosis", diagnosis_from_json)


def write_diagnosis(path: Path, diagnosis: Diagnosis, provenance: Provenance | None = None) -> None:
    """Write a diagnosis. Raises AlreadyExistsError where the file exists, CannotWriteError where it cannot be
    written."""
    write_json(path, FORMAT, VERSION, diagnosis_to_json(diagnosis), provenance)
