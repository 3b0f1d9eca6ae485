"""Blind test for a laboratory: draws the random order of physical changes to a device, and seals the table of labels.

The seal is a commitment by hash: the SHA-256 of the table is published before the recordings are diagnosed, so that the
labels cannot be changed to suit the answers. `score_kit` scores the answers.
"""

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
CORRECT_FIRST = "Correct it before it is sealed; from then on nothing in it may be changed."
"""Advice for an invalid table."""


def draw_labels(table_path: Path, repeats: int, seed: int | None) -> tuple[Label, ...]:
    """Write a table with every change `repeats` times, and the control (nothing is changed) twice as often, in random
    order. Each row has a random salt, so that the order cannot be found by trying all orders against the seal's hash.
    seed: of the order; None draws a secret seed. Raises AlreadyThereError, CannotWriteError."""
    change_names = [
        change.name for change in CHANGES for _ in range(repeats * (2 if change.name == CONTROL_CHANGE else 1))
    ]
    order = np.random.default_rng(secrets.randbits(64) if seed is None else seed).permutation(len(change_names))
    labels = tuple(
        Label(f"rec_{number:02d}", change_names[int(index)], None, "", secrets.token_hex(8))
        for number, index in enumerate(order, start=1)
    )
    write_text(table_path, format_csv_table(labels, Label))
    return labels


def read_labels(path: Path) -> tuple[Label, ...]:
    """The rows of a table of labels. Raises CannotReadError; UnusableFileError for an invalid or empty table, an
    unknown change, or a recording that appears twice."""
    try:
        labels = parse_csv_table(read_text(path), Label)
    except CsvError as error:
        raise UnusableFileError(path, "table of labels", error.problems, CORRECT_FIRST) from error
    problems = [
        f"{label.recording}: '{label.change}' is no change of the kit"
        f"{suggest_word(label.change, tuple(CHANGES_BY_NAME))}"
        for label in labels
        if label.change not in CHANGES_BY_NAME
    ]
    names = [label.recording for label in labels]
    problems += [f"{name} is there twice" for name in sorted({name for name in names if names.count(name) > 1})]
    if problems or not labels:
        raise UnusableFileError(path, "table of labels", tuple(problems) or ("it holds no recording",), CORRECT_FIRST)
    return labels


def seal_labels(path: Path) -> str:
    """SHA-256 of the table's bytes, also written to the file `seal_of` in the format of `sha256sum --check`. An
    existing seal is not replaced. Raises StudyError where the table is invalid or was sealed with other content."""
    read_labels(path)
    digest, seal = compute_sha256(path), seal_of(path)
    if not seal.exists():
        write_text(seal, f"{digest}  {path.name}\n")
    elif (earlier_hash := read_sealed_hash(path)) != digest:
        raise StudyError(
            "The table was sealed before, with another hash",
            f"{seal.name} says {earlier_hash or 'no hash'}; {path.name} has {digest} now.",
            "Put the table back as it was sealed. If it was wrong then, draw a new one under another name, and record "
            "again: the first hash is known to those who diagnose.",
            saved="Nothing was changed.",
        )
    return digest


def seal_of(path: Path) -> Path:
    """Path of the seal file of a table, in the same folder."""
    return path.with_name(path.name + SEAL_SUFFIX)


def read_sealed_hash(path: Path) -> str:
    """Hash in the seal file of a table, lower case; empty where there is none. Raises CannotReadError."""
    seal = seal_of(path)
    texts = read_text(seal).split() if seal.exists() else []
    return texts[0].lower() if texts else ""
