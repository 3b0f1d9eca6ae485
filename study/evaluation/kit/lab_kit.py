"""Blind test for a laboratory: draws the random order of physical changes to a device, and seals the table of labels.

The seal is a commitment by hash: the SHA-256 of the table is published before the recordings are diagnosed, so that the
labels cannot be changed to suit the answers. `score_kit` scores the answers.
"""

import math
import secrets
from pathlib import Path

import numpy as np

from analysis.evaluation.blind_test.lab_kit import CHANGES, CHANGES_BY_NAME, CONTROL_CHANGE, Label
from equalizer.plant.mechanical_model import suggest_word
from study.errors import StudyError
from study.store.disk.csv_rows import CsvError, format_csv_table, parse_csv_table
from study.store.disk.file_errors import UnusableFileError
from study.store.disk.provenance import compute_sha256
from study.store.disk.text_file import read_text, write_text

SEAL_SUFFIX = ".sha256"
"""Suffix of the seal file, added to the name of the table."""
CORRECT_TABLE_ADVICE = "Correct it before it is sealed; from then on nothing in it may be changed."
"""Remedy in the errors on an invalid table."""


def draw_labels(table_path: Path, repeats: int, seed: int | None) -> tuple[Label, ...]:
    """Draw the labels and write them as a table: every change `repeats` times, and the control (nothing is changed)
    twice as often, in random order. Each row has a random salt of 64 bits (chosen), so that the order cannot be found
    by trying all orders against the seal's hash. seed: of the order; None draws a secret seed. Raises
    AlreadyExistsError where the table exists, CannotWriteError where it cannot be written."""
    change_names = [
        change.name for change in CHANGES for _ in range(repeats * (2 if change.name == CONTROL_CHANGE else 1))
    ]
    change_order = np.random.default_rng(secrets.randbits(64) if seed is None else seed).permutation(len(change_names))
    labels = tuple(
        Label(f"rec_{number:02d}", change_names[int(index)], None, "", secrets.token_hex(8))
        for number, index in enumerate(change_order, start=1)
    )
    write_text(table_path, format_csv_table(labels, Label))
    return labels


def read_labels(table_path: Path) -> tuple[Label, ...]:
    """Read the rows of a table of labels. Raises CannotReadError; UnusableFileError for an invalid or empty table, an
    unknown change, a recording that appears twice or whose name is a path, or a value that is not finite."""
    try:
        labels = parse_csv_table(read_text(table_path), Label)
    except CsvError as error:
        raise UnusableFileError(table_path, "table of labels", error.problems, CORRECT_TABLE_ADVICE) from error
    problems = [
        f"{label.recording}: '{label.change}' is no change of the kit"
        f"{suggest_word(label.change, tuple(CHANGES_BY_NAME))}"
        for label in labels
        if label.change not in CHANGES_BY_NAME
    ]
    problems += [
        f"'{label.recording}' is no name of a recording: it must be the name of a file without its ending, such as "
        "rec_01, without a folder or a blank at an end"
        for label in labels
        if not _is_plain_name(label.recording)
    ]
    problems += [
        f"{label.recording}: its value is {label.value}, which is no finite number"
        for label in labels
        if label.value is not None and not math.isfinite(label.value)
    ]
    recording_names = [label.recording for label in labels]
    problems += [
        f"{name} is there twice"
        for name in sorted({name for name in recording_names if recording_names.count(name) > 1})
    ]
    if problems or not labels:
        raise UnusableFileError(
            table_path, "table of labels", tuple(problems) or ("it holds no recording",), CORRECT_TABLE_ADVICE
        )
    return labels


def _is_plain_name(name: str) -> bool:
    """Whether a name is that of a folder beside the others, so that two names never mean one diagnosis."""
    return name.strip() == name and name not in ("", ".", "..") and not set(name) & set("/\\\0")


def seal_labels(table_path: Path) -> str:
    """Seal a table: returns the SHA-256 of its bytes, and writes it to the seal file in the format of `sha256sum
    --check`. An existing seal is not replaced. Raises StudyError where the table is invalid, was sealed with other
    content, or the seal cannot be written."""
    read_labels(table_path)
    table_hash, seal_path = compute_sha256(table_path), make_seal_path(table_path)
    if not seal_path.exists():
        write_text(seal_path, f"{table_hash}  {table_path.name}\n")
    elif (earlier_hash := read_sealed_hash(table_path)) != table_hash:
        raise StudyError(
            "The table was sealed before, with another hash",
            f"{seal_path.name} says {earlier_hash or 'no hash'}; {table_path.name} has {table_hash} now.",
            "Put the table back as it was sealed. If it was wrong then, draw a new one under another name, and record "
            "again: the first hash is known to those who diagnose.",
            saved="Nothing was changed.",
        )
    return table_hash


def make_seal_path(table_path: Path) -> Path:
    """Make the path of the seal file of a table: the table's path with `SEAL_SUFFIX`."""
    return table_path.with_name(table_path.name + SEAL_SUFFIX)


def read_sealed_hash(table_path: Path) -> str:
    """Read the hash in the seal file of a table, in lower case; empty where the file is missing or empty. Raises
    CannotReadError."""
    seal_path = make_seal_path(table_path)
    words = read_text(seal_path).split() if seal_path.exists() else []
    return words[0].lower() if words else ""
