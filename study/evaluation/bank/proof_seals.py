"""Seals of a blind test (commitment by hash): the SHA-256 of a label is written before its cases are answered, and
compared when it is revealed.

A label states the true effect of a case and the hashes of its files; an answer must have been given to files with the
same hashes. So neither label nor file of a case can be changed unnoticed after it was sealed.
"""

import hashlib
from pathlib import Path
from typing import Any

from analysis.diagnosis.document import DiagnosisError, diagnosis_from_json
from study.errors import StudyError
from study.evaluation.bank.proof_folder import (
    ANSWER_FILE,
    MODEL_FILE,
    RECORDING_FILE,
    SETTINGS_FILE,
    WORKER_DIED_KEY,
    ProofFolder,
)
from study.store.disk.file_errors import UnusableFileError
from study.store.disk.json_document import parse_json
from study.store.disk.provenance import compute_sha256
from study.store.disk.strict_json import load_json
from study.store.disk.text_file import read_text, write_text

HASH_KEYS = ("recording_sha256", "model_sha256", "settings_sha256", "others_sha256")
"""Keys of the hashes in label and answer; with equal values, the answer belongs to the sealed files. Labels of earlier
versions lack some of them."""


def hash_case_files(case_folder: Path) -> dict[str, Any]:
    """Compute the SHA-256 of all files that the diagnosis of a case gets, by the keys `HASH_KEYS`; of recordings other
    than the first, by their paths relative to `case_folder`. Raises CannotReadError where a file is missing."""
    other_paths = [path for path in sorted(case_folder.rglob("*.h5")) if path != case_folder / RECORDING_FILE]
    return {
        "recording_sha256": compute_sha256(case_folder / RECORDING_FILE),
        "model_sha256": compute_sha256(case_folder / MODEL_FILE),
        "settings_sha256": compute_sha256(case_folder / SETTINGS_FILE),
        "others_sha256": {str(path.relative_to(case_folder)): compute_sha256(path) for path in other_paths},
    }


def seal(folder: ProofFolder) -> str:
    """Append the hashes of new labels to labels.sha256 after checking the existing ones. Returns the SHA-256 of that
    file.

    Raises StudyError where a sealed label is missing or changed, or the file is malformed.
    """
    sealed_hashes = read_seals(folder)
    if changed_names := [
        name
        for name, digest in sealed_hashes.items()
        if not (folder.path / name).exists() or compute_sha256(folder.path / name) != digest
    ]:
        raise make_broken_seal_error(changed_names, folder.path)
    new_labels = [path for path in folder.labels if f"sealed/{path.name}" not in sealed_hashes]
    lines = [f"{digest}  {name}\n" for name, digest in sealed_hashes.items()]
    lines += [f"{compute_sha256(path)}  sealed/{path.name}\n" for path in new_labels]
    if new_labels or not folder.seals_file.exists():
        write_text(folder.seals_file, "".join(lines), overwrite=True)
    return hashlib.sha256("".join(lines).encode()).hexdigest()


def read_seals(folder: ProofFolder) -> dict[str, str]:
    """Read labels.sha256: SHA-256 (64 hexadecimal digits) by path of a label relative to the bank; empty if nothing is
    sealed yet. Raises StudyError for a malformed file."""
    if not folder.seals_file.exists():
        return {}
    rows = [line.split() for line in read_text(folder.seals_file).splitlines()]
    if any(len(row) != 2 or len(row[0]) != 64 for row in rows):
        raise make_broken_seal_error([folder.seals_file.name], folder.path)
    return {name: digest for digest, name in rows}


def read_label(path: Path) -> dict[str, Any]:
    """Read and parse the sealed label at `path`. Raises StudyError where it cannot be read or is no JSON object."""
    return parse_json(path, read_text(path), "sealed label")


def read_answer(case_folder: Path) -> dict[str, Any]:
    """Read and parse the answer.json in `case_folder`; NaN is allowed (an unknown error). Raises StudyError where it
    cannot be read, is no JSON object, or holds an invalid diagnosis, as one of another version of hapteq may be."""
    path = case_folder / ANSWER_FILE
    advice = f"Delete {path}, and run the same command again: the case is diagnosed again."
    try:
        document = load_json(read_text(path), with_nan=True)
        if not isinstance(document, dict):
            raise UnusableFileError(path, "answer of a diagnosis", ("it contains no JSON object",), advice)
        if "diagnosis" in document:
            diagnosis_from_json(document["diagnosis"])
    except DiagnosisError as error:
        raise UnusableFileError(path, "answer of a diagnosis", error.problems, advice) from error
    except ValueError as problem:
        raise UnusableFileError(path, "answer of a diagnosis", (f"this is not JSON: {problem}",), advice) from problem
    return document


def is_answer_to_sealed_case(label: dict[str, Any], answer: dict[str, Any]) -> bool:
    """Whether an answer was given to the sealed files by a process that had not imported the package `challenge`, which
    contains the true effects. True for the answer written for a worker that died, which contains no diagnosis. label:
    of the case, revealed."""
    if WORKER_DIED_KEY in answer:
        return True
    return answer.get("knows_the_challenge") is False and all(
        key in answer and answer[key] == label[key] for key in HASH_KEYS if key in label
    )


def make_broken_seal_error(names: list[str], path: Path) -> StudyError:
    """Make the error for cases whose files differ from the sealed files, or for a malformed list of seals. names: of
    the cases, labels or list; path: folder of the bank."""
    return StudyError(
        "A seal is broken",
        f"Of {len(names)} sealed items ({', '.join(names[:5])}) in {path} the label, a file of the case or the list of "
        "seals is not what was sealed before the diagnosis.",
        "Run the bank again in another folder; this one proves nothing.",
        saved="Nothing was changed.",
    )
