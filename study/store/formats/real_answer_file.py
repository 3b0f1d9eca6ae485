"""Result of the diagnosis of a real recording in the evaluation, `answer.json`: the format `hapteq-real-answer`,
version 1.

This module reads and writes the file; `analysis.diagnosis.real_answer.real_answer` defines and checks its content.
"""

from pathlib import Path
from typing import Any

from analysis.diagnosis.real_answer.real_answer import (
    FORMAT,
    VERSION,
    RealAnswer,
    real_answer_from_json,
    real_answer_to_json,
)
from study.store.disk.file_errors import convert_problems
from study.store.disk.json_document import read_json, write_json
from study.store.disk.provenance import Provenance


def read_real_answer(path: Path) -> RealAnswer:
    """Read an answer, without its provenance. Raises as `read_answer_and_provenance`."""
    return read_answer_and_provenance(path)[0]


def read_answer_and_provenance(path: Path) -> tuple[RealAnswer, dict[str, Any]]:
    """Read an answer and its provenance (empty where the file has none). Raises CannotReadError where the file cannot
    be read, UnusableFileError where it has another format or version, or invalid content."""
    document: dict[str, Any] = read_json(path, FORMAT, VERSION)
    provenance = document.pop("provenance", None)
    with convert_problems(path, "answer to a real recording"):
        return real_answer_from_json(document), provenance if isinstance(provenance, dict) else {}


def write_real_answer(path: Path, answer: RealAnswer, provenance: Provenance | None = None) -> None:
    """Write an answer. Raises AlreadyExistsError where the file exists, CannotWriteError where it cannot be written."""
    write_json(path, FORMAT, VERSION, real_answer_to_json(answer), provenance)
