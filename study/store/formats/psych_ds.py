"""Export of trials as a Psych-DS dataset: a CSV table for each session below `data/`, and a description of its columns.

Psych-DS, schema version 0.4.0 (https://psych-ds.github.io), sets the file names (`keyword-value` pairs, ending in
`_data.csv`) and `dataset_description.json` (schema.org JSON-LD that names every column). The protocol is stored in
`materials/`, so that `hapteq analyze` can analyse the dataset again.
"""

import json
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from protocols.trial import Trial
from study.store.disk.csv_rows import format_csv_table, list_columns
from study.store.disk.file_errors import UnusableFileError
from study.store.disk.strict_json import load_json
from study.store.disk.text_file import read_text, write_text
from study.store.formats.answer_table import AnswerTable
from study.store.formats.trial_columns import TRIAL_COLUMNS
from study.store.formats.trials_file import read_trials

DESCRIPTION_NAME = "dataset_description.json"
"""Name of the dataset's description, as the standard sets it."""
PROTOCOL_PATH = "materials/protocol.toml"
"""Path of the protocol within the dataset."""
ANSWERS_PATH = "data/description-answers_data.csv"
"""Path of the answers to questionnaires; written only where the protocol has questions."""
KIND = "Psych-DS dataset"
"""Name of this kind of folder in messages."""
FACTS_KEY = "hapteq"
"""Key in the description for data that only hapteq reads: provenance, seeds, devices."""

README = """# {name}

Trials of a study of force directions, exported by hapteq: one table per session below `data/`, a row for each
presentation. `dataset_description.json` says what each column means and its unit. A row is identified by the columns
session, run, trial and attempt. `materials/protocol.toml` is the protocol; `hapteq analyze` takes this folder.
"""
"""Text of the dataset's README; {name} is replaced by the name of the dataset."""


@dataclass(frozen=True, slots=True)
class ExportedTrials:
    """Content of an exported dataset."""

    trials: tuple[Trial, ...]
    protocol_text: str
    facts: Mapping[str, Any]
    """Provenance, seeds and devices, as under `FACTS_KEY`."""
    files: tuple[Path, ...]
    """The tables of trials, sorted by name."""


def is_psych_ds(folder: Path) -> bool:
    """Whether the folder contains the description and the protocol of an exported Psych-DS dataset."""
    return (folder / DESCRIPTION_NAME).is_file() and (folder / PROTOCOL_PATH).is_file()


def write_psych_ds(
    folder: Path,
    name: str,
    trials: Sequence[Trial],
    protocol_text: str,
    facts: Mapping[str, Any],
    answers: AnswerTable = AnswerTable(),  # noqa: B008  frozen
) -> tuple[Path, ...]:
    """Write the dataset, and return the paths of its files. folder: existing and empty; facts: JSON values, written
    under `FACTS_KEY`. Raises CannotWriteError where a file cannot be written, and OSError where a folder cannot."""
    (folder / "data").mkdir()
    (folder / "materials").mkdir()
    paths = []
    for session in dict.fromkeys(trial.session for trial in trials):
        rows = [trial for trial in trials if trial.session == session]
        path = folder / "data" / f"subject-{_format_value(rows[0].subject)}_session-{_format_value(session)}_data.csv"
        write_text(path, format_csv_table(rows, Trial), overwrite=False)
        paths.append(path)
    if answers.columns:
        paths.append(folder / ANSWERS_PATH)
        write_text(folder / ANSWERS_PATH, answers.as_csv(), overwrite=False)
    write_text(folder / PROTOCOL_PATH, protocol_text, overwrite=False)
    dataset_description = {
        "@context": "https://schema.org/",
        "@type": "Dataset",
        "name": name,
        "description": "Trials of a study of force directions, one row per presentation, as hapteq logged them.",
        "schemaVersion": "Psych-DS 0.4.0",
        "variableMeasured": [
            *(_describe_variable(column, *TRIAL_COLUMNS[column]) for column in list_columns(Trial)),
            *(_describe_variable(column.name, column.description, column.question.unit) for column in answers.columns),
        ],
        FACTS_KEY: dict(facts),
    }
    write_text(
        folder / DESCRIPTION_NAME, json.dumps(dataset_description, indent=2, ensure_ascii=False) + "\n", overwrite=False
    )
    texts = {"README.md": README.format(name=name), "CHANGES.md": "# 1.0.0\n\nAs exported by hapteq.\n"}
    for file_name, text in texts.items():
        write_text(folder / file_name, text, overwrite=False)
    return (*paths, folder / PROTOCOL_PATH, folder / DESCRIPTION_NAME, *(folder / text_name for text_name in texts))


def read_psych_ds(folder: Path) -> ExportedTrials:
    """Read a dataset that `write_psych_ds` wrote. Raises CannotReadError where a file cannot be read, UnusableFileError
    where the description is no JSON object with `FACTS_KEY`, there is no table, or a table is invalid."""
    path = folder / DESCRIPTION_NAME
    try:
        dataset_description = load_json(read_text(path))
    except ValueError as error:
        raise UnusableFileError(path, KIND, (str(error),)) from error
    facts = dataset_description.get(FACTS_KEY) if isinstance(dataset_description, dict) else None
    files = tuple(sorted((folder / "data").glob("subject-*_data.csv")))
    if not isinstance(facts, dict) or not files:
        problem = (
            "no file below data/ is named subject-…_data.csv"
            if isinstance(facts, dict)
            else f"the key '{FACTS_KEY}' is missing"
        )
        raise UnusableFileError(path, KIND, (problem,))
    trials = tuple(trial for file_path in files for trial in read_trials(file_path, KIND))
    return ExportedTrials(trials, read_text(folder / PROTOCOL_PATH), facts, files)


def _describe_variable(column: str, description: str, unit: str) -> dict[str, str]:
    """Describe a column as a schema.org PropertyValue; without `unitText` where the unit is empty."""
    variable = {"@type": "PropertyValue", "name": column, "description": description}
    return {**variable, "unitText": unit} if unit else variable


def _format_value(text: str) -> str:
    """Make the value of a pair `keyword-value` in a file name: the ASCII letters and digits of the text, the only
    characters that Psych-DS permits there."""
    return re.sub(r"[^A-Za-z0-9]", "", text)
