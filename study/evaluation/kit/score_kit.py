"""Score a laboratory's blind test: compare the revealed table of physical changes with the diagnoses.

The table was sealed by its SHA-256 before the diagnoses (`hapteq kit seal`). Its hash is checked first, so that labels
that were changed afterwards are refused. `analysis.evaluation.blind_test.lab_kit` defines which diagnoses are right.
"""

import json
import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from analysis.diagnosis.document import FORMAT, VERSION, Diagnosis
from analysis.evaluation.blind_test.confidence_intervals import IntervalEstimate
from analysis.evaluation.blind_test.lab_kit import (
    NO_DIAGNOSIS,
    Label,
    ScoredLabel,
    compute_kit_figures,
    score_label,
    score_unanswered,
)
from study.errors import StudyError, WrongUseError
from study.evaluation.kit.lab_kit import make_seal_path, read_labels, read_sealed_hash
from study.store.disk.csv_rows import format_csv_table
from study.store.disk.json_document import read_json
from study.store.disk.provenance import compute_sha256
from study.store.disk.text_file import write_text
from study.store.formats.diagnosis_file import DIAGNOSIS_NAME, read_diagnosis

NOTHING_SCORED = "Nothing was scored, and nothing written."
"""Sentence on the saved files in every error that this module raises itself."""


@dataclass(frozen=True, slots=True)
class KitScore:
    """Diagnoses of a lab's recordings compared with the sealed labels."""

    rows: tuple[ScoredLabel, ...]
    """One row per label, including labels without a diagnosis."""
    figures: tuple[IntervalEstimate, ...]
    """Rates with their 95 % confidence intervals."""
    sha256: str
    """SHA-256 of the table of labels."""
    compared_with: str
    """Source of the hash with which `sha256` was compared, in words."""


def score_kit(table_path: Path, diagnoses_folder: Path, scores_path: Path, seal: str | None = None) -> KitScore:
    """Score a laboratory's diagnoses against its revealed table, and write the scored rows to `scores_path` as CSV.
    diagnoses_folder: a folder per recording, as `hapteq diagnose --out` writes them. seal: the hash that was handed
    over before the diagnoses; None: the table is compared only with the seal file next to it. Raises StudyError where
    the hashes differ or there is no seal, the table is invalid, no diagnosis is found, one is unusable, two are of one
    recording, or the scores cannot be written."""
    table_hash = compute_sha256(table_path)
    compared_with = _require_sealed_hash(table_path, table_hash, seal)
    labels = read_labels(table_path)
    label_diagnoses = _read_diagnoses(diagnoses_folder, labels)
    scored_labels = tuple(
        score_unanswered(label) if diagnosis is None else score_label(label, diagnosis)
        for label, diagnosis in zip(labels, label_diagnoses, strict=True)
    )
    write_text(scores_path, format_csv_table(scored_labels, ScoredLabel))
    return KitScore(scored_labels, compute_kit_figures(scored_labels), table_hash, compared_with)


def format_score_lines(score: KitScore) -> tuple[str, ...]:
    """Format the score as lines for a terminal: rates, labels that were missed or have no diagnosis, and the hash."""
    figure_lines = (_format_figure(figure) for figure in score.figures)
    missed_lines = (_format_missed_label(row) for row in score.rows if not row.right)
    return (*figure_lines, *missed_lines, f"Labels: SHA-256 {score.sha256}, {score.compared_with}.")


def _format_figure(figure: IntervalEstimate) -> str:
    """Format a rate: counts, percent, and 95 % confidence interval in brackets; "none" without a case."""
    if figure.value is None or figure.low is None or figure.high is None:
        return f"{figure.name}: none"
    interval = f"[{100 * figure.low:.0f}, {100 * figure.high:.0f}]"
    return f"{figure.name}: {figure.hits} of {figure.of}, {100 * figure.value:.0f} % {interval}"


def _format_missed_label(scored_label: ScoredLabel) -> str:
    """Format the line of a label that was missed by its diagnosis, or has none."""
    if scored_label.verdict == NO_DIAGNOSIS:
        return f"Missing: {scored_label.recording}, {scored_label.change}: no diagnosis; it counts as not right."
    return (
        f"Missed: {scored_label.recording}, {scored_label.change}: {scored_label.verdict.replace('_', ' ')}, "
        f"named {scored_label.named or 'nothing'}."
    )


def _read_diagnoses(diagnoses_folder: Path, labels: tuple[Label, ...]) -> tuple[Diagnosis | None, ...]:
    """Read the diagnosis of each label, in order; None for a label without a diagnosis. Raises StudyError where the
    folder is missing, no label has a diagnosis, a diagnosis is unusable, or two are of one recording."""
    if not diagnoses_folder.is_dir():
        raise StudyError(
            "There is no such folder",
            f"{diagnoses_folder} is no folder of diagnoses.",
            "Give --diagnoses the folder that holds one folder per recording, by its name.",
            saved=NOTHING_SCORED,
        )
    diagnoses = tuple(_read_one_diagnosis(diagnoses_folder, label.recording) for label in labels)
    if any(diagnosis is not None for diagnosis in diagnoses):
        _require_own_recordings(
            diagnoses_folder,
            [label.recording for label, found in zip(labels, diagnoses, strict=True) if found is not None],
        )
        return diagnoses
    raise StudyError(
        "There is no diagnosis to score",
        f"{diagnoses_folder} holds no {DIAGNOSIS_NAME} of any recording in the table, such as "
        f"{labels[0].recording}/{DIAGNOSIS_NAME}.",
        "Give --diagnoses the folder that holds one folder per recording, by its name.",
        saved=NOTHING_SCORED,
    )


def _read_one_diagnosis(diagnoses_folder: Path, recording_name: str) -> Diagnosis | None:
    """Read the diagnosis of a recording; None where its file is missing. Raises StudyError where the file is
    unusable."""
    path = diagnoses_folder / recording_name / DIAGNOSIS_NAME
    if not path.is_file():
        return None
    try:
        return read_diagnosis(path)
    except StudyError as error:
        raise StudyError(
            f"{recording_name}/{error.title}",
            error.happened,
            f"Get {path.parent} again as `hapteq diagnose` wrote it, or move it away: then it counts as not right.",
            saved=NOTHING_SCORED,
        ) from error


def _require_own_recordings(diagnoses_folder: Path, recording_names: Sequence[str]) -> None:
    """Raise StudyError where two diagnoses are of one recording (file name and content), as in a copied folder: it
    would count twice. A diagnosis whose file states no recording is not compared."""
    names_by_recording: dict[str, str] = {}
    for name in recording_names:
        provenance = read_json(diagnoses_folder / name / DIAGNOSIS_NAME, FORMAT, VERSION).get("provenance")
        parents = provenance.get("parents") if isinstance(provenance, dict) else None
        if not isinstance(parents, list) or not parents:
            continue
        other_name = names_by_recording.setdefault(json.dumps(parents[0]), name)
        if other_name != name:
            raise StudyError(
                "Two diagnoses are of the same recording",
                f"{other_name}/{DIAGNOSIS_NAME} and {name}/{DIAGNOSIS_NAME} in {diagnoses_folder} were made from one "
                "file: one of the folders is a copy.",
                f"Diagnose the recordings {other_name} and {name} each into its folder, or move the copy away: then it "
                "counts as not right.",
                saved=NOTHING_SCORED,
            )


def _require_sealed_hash(table_path: Path, table_hash: str, seal: str | None) -> str:
    """Compare the hash of the table with `seal`, or without it with the seal file. Returns the source of the sealed
    hash in words. Raises StudyError where the hashes differ or there is no seal file, WrongUseError where `seal` is no
    hash."""
    seal_path = make_seal_path(table_path)
    if seal is None:
        sealed_hash, source = read_sealed_hash(table_path), f"{seal_path.name} says"
        comparison = (
            f"compared only with {seal_path.name} in the same folder, which can be rewritten together with the table: "
            "give --seal the hash that was handed over before the diagnoses"
        )
    else:
        sealed_hash, source, comparison = _parse_hash(seal), "--seal gives", "the hash that --seal gives"
    if sealed_hash == table_hash:
        return comparison
    raise StudyError(
        "The labels are not those that were sealed",
        f"{table_path.name} has the hash {table_hash}; {source} {sealed_hash}."
        if sealed_hash
        else f"There is no seal in {seal_path.name}.",
        "Score the table as it was sealed before the diagnoses; changes made to it since cannot be trusted.",
        saved=NOTHING_SCORED,
    )


def _parse_hash(seal_text: str) -> str:
    """Parse the hash in the value of --seal, which may be the whole line of the seal file; returns it in lower case.
    Raises WrongUseError where its first word is no SHA-256."""
    first_word = (seal_text.split() or [""])[0].lower()
    if re.fullmatch("[0-9a-f]{64}", first_word):
        return first_word
    raise WrongUseError(
        "That is no SHA-256",
        f"--seal gives '{seal_text}'; a hash has 64 digits from 0 to 9 and a to f.",
        "Give the whole hash, as `hapteq kit seal` printed it.",
        saved=NOTHING_SCORED,
    )
