"""A laboratory's own blind test: the order of changes is drawn, sealed by its hash, and scored when it is revealed."""

import hashlib
import secrets
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from analysis.proof.lab_kit import CHANGES, CHANGES_BY_NAME, NOTHING, Label, Scored, kit_figures, scored
from analysis.proof.share import Figure
from equalizer.plant.mechanical_model import nearest
from study.errors import StudyError
from study.store.csv_rows import CsvError, rows_from_csv, rows_to_csv
from study.store.diagnosis_file import read_diagnosis
from study.store.file_errors import UnusableFileError
from study.store.text_file import read_text, write_text
from study.workflows.write_diagnosis import DIAGNOSIS_NAME

SEAL_SUFFIX = ".sha256"


@dataclass(frozen=True, slots=True)
class KitScore:
    rows: tuple[Scored, ...]
    figures: tuple[Figure, ...]
    missing: tuple[str, ...]
    """Recordings without a diagnosis."""


def draw_labels(out: Path, repeats: int, seed: int | None) -> tuple[Label, ...]:
    """Each change so many times, and nothing twice as often, in a drawn order. seed: None draws one that nobody knows.
    Raises AlreadyThereError, CannotWriteError."""
    every = [one.name for one in CHANGES for _ in range(repeats * (2 if one.name == NOTHING else 1))]
    order = np.random.default_rng(secrets.randbits(64) if seed is None else seed).permutation(len(every))
    labels = tuple(
        Label(f"rec_{number:02d}", every[int(place)], None, "", secrets.token_hex(8))
        for number, place in enumerate(order, start=1)
    )
    write_text(out, rows_to_csv(labels, Label))
    return labels


def seal_labels(path: Path) -> str:
    """The SHA-256 of the table, also beside it as `sha256sum --check` reads it. Raises StudyError where the table is
    none, or is sealed already."""
    read_labels(path)
    digest = _digest(path)
    write_text(_seal(path), f"{digest}  {path.name}\n")
    return digest


def read_labels(path: Path) -> tuple[Label, ...]:
    """Raises CannotReadError, UnusableFileError."""
    try:
        labels = rows_from_csv(read_text(path), Label)
    except CsvError as error:
        raise UnusableFileError(path, "table of labels", error.problems) from error
    problems = [
        f"{one.recording}: '{one.change}' is no change of the kit{nearest(one.change, tuple(CHANGES_BY_NAME))}"
        for one in labels
        if one.change not in CHANGES_BY_NAME
    ]
    names = [one.recording for one in labels]
    problems += [f"{name} is there twice" for name in sorted({one for one in names if names.count(one) > 1})]
    if problems or not labels:
        raise UnusableFileError(path, "table of labels", tuple(problems) or ("it holds no recording",))
    return labels


def score_kit(path: Path, diagnoses: Path, out: Path) -> KitScore:
    """diagnoses: a folder per recording, as `hapteq diagnose --out` writes them. Raises StudyError."""
    labels = read_labels(path)
    _require_sealed(path)
    found = [(one, diagnoses / one.recording / DIAGNOSIS_NAME) for one in labels]
    rows = tuple(scored(label, read_diagnosis(place)) for label, place in found if place.is_file())
    write_text(out, rows_to_csv(rows, Scored))
    return KitScore(rows, kit_figures(rows), tuple(label.recording for label, place in found if not place.is_file()))


def score_lines(score: KitScore) -> tuple[str, ...]:
    lines = [_row_line(one) for one in score.rows if not one.right]
    missing: Sequence[str] = (f"Without a diagnosis: {', '.join(score.missing)}.",) if score.missing else ()
    return (*(_figure_line(one) for one in score.figures), *missing, *lines)


def _figure_line(one: Figure) -> str:
    if one.value is None or one.low is None or one.high is None:
        return f"{one.name}: none"
    return f"{one.name}: {one.hits} of {one.of}, {100 * one.value:.0f} % [{100 * one.low:.0f}, {100 * one.high:.0f}]"


def _row_line(one: Scored) -> str:
    return f"Missed: {one.recording}, {one.change}: {one.verdict.replace('_', ' ')}, named {one.named or 'nothing'}."


def _require_sealed(path: Path) -> None:
    seal = _seal(path)
    said = read_text(seal).split()[:1] if seal.is_file() else []
    if said == [_digest(path)]:
        return
    raise StudyError(
        "The labels are not those that were sealed",
        f"{path.name} has another hash than {seal.name} says." if said else f"There is no seal, {seal.name}.",
        "Score the table as it was sealed before the diagnoses; what was changed in it since, nobody can trust.",
        saved="Nothing was scored.",
    )


def _seal(path: Path) -> Path:
    return path.with_name(path.name + SEAL_SUFFIX)


def _digest(path: Path) -> str:
    return hashlib.sha256(read_text(path).encode()).hexdigest()
