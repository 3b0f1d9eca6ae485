"""Seals of a blind test (commitment by hash): the SHA-256 of a label is written before its cases are answered, and
compared when it is revealed.

A label states the true effect of a case and the hashes of its files; an answer must have been given to files with the
same hashes. So neither label nor recording can be changed unnoticed after an answer is known.
"""

import hashlib
from pathlib import Path
from typing import Any

from study.errors import StudyError
from study.evaluation.bank.proof_folder import ANSWER_FILE, WORKER_DIED_KEY, ProofFolder
from study.store.disk.file_errors import UnusableFileError
from study.store.disk.json_document import parse_json
from study.store.disk.provenance import compute_sha256
from study.store.disk.strict_json import load_json
from study.store.disk.text_file import read_text, write_text

HASH_KEYS = ("recording_sha256", "model_sha256", "others_sha256")
"""Keys of the hashes in label and answer; with equal values, the answer belongs to the sealed files."""


def seal(folder: ProofFolder) -> str:
    """Append the hashes of new labels to labels.sha256 after checking the existing ones. Returns the SHA-256 of that
    file.

    Raises StudyError where a sealed label is missing or changed, or the file is malformed.
    """
    sealed_hashes = read_seals(folder)
    if changed_names := [name for name, digest in sealed_hashes.items() if _hash_file(folder.path / name) != digest]:
        raise make_broken_seal_error(changed_names, folder.path)
    new_labels = [path for path in sorted(folder.sealed.glob("*.json")) if f"sealed/{path.name}" not in sealed_hashes]
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
    cannot be read or is no JSON object."""
    try:
        document = load_json(read_text(case_folder / ANSWER_FILE), with_nan=True)
    except ValueError as problem:
        raise UnusableFileError(
            case_folder / ANSWER_FILE, "answer of a diagnosis", (f"this is not JSON: {problem}",)
        ) from problem
    if not isinstance(document, dict):
        raise UnusableFileError(case_folder / ANSWER_FILE, "answer of a diagnosis", ("it contains no JSON object",))
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


def _hash_file(path: Path) -> str:
    """Compute the SHA-256 of a file; empty where there is none."""
    return compute_sha256(path) if path.exists() else ""
