"""Trials as one tidy table, a row per presentation, with a data dictionary, the protocol and the facts."""

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from protocols.trial import Trial
from study.store.disk.csv_rows import columns, csv_line, rows_to_csv
from study.store.disk.file_errors import UnusableFileError
from study.store.disk.strict_json import load_json
from study.store.disk.text_file import read_text, write_text
from study.store.formats.answer_table import AnswerTable
from study.store.formats.psych_ds import ExportedTrials, trials_in
from study.store.formats.trial_columns import TRIAL_COLUMNS

TRIALS_NAME, DICTIONARY_NAME, PROTOCOL_NAME, FACTS_NAME = "trials.csv", "dictionary.csv", "protocol.toml", "facts.json"
ANSWERS_NAME = "answers.csv"
"""Only where the protocol asks questions."""
KIND = "table of exported trials"
"""What messages call such a file."""


def is_tidy_csv(folder: Path) -> bool:
    """Whether the folder contains all four files of an export as CSV."""
    return all((folder / name).is_file() for name in (TRIALS_NAME, DICTIONARY_NAME, PROTOCOL_NAME, FACTS_NAME))


def write_tidy_csv(
    folder: Path,
    name: str,
    trials: Sequence[Trial],
    protocol_text: str,
    facts: Mapping[str, Any],
    answers: AnswerTable = AnswerTable(),  # noqa: B008  frozen
) -> tuple[Path, ...]:
    """Write the table. folder: existing and empty. name: of the study. facts: JSON values. Raises CannotWriteError."""
    rows = [["column", "description", "unit"], *([column, *TRIAL_COLUMNS[column]] for column in columns(Trial))]
    rows += [[column.name, column.description, column.question.unit] for column in answers.columns]
    texts = {
        TRIALS_NAME: rows_to_csv(trials, Trial),
        DICTIONARY_NAME: "".join(csv_line(row) + "\n" for row in rows),
        PROTOCOL_NAME: protocol_text,
        FACTS_NAME: json.dumps({"study": name, **facts}, indent=2, ensure_ascii=False) + "\n",
    }
    if answers.columns:
        texts[ANSWERS_NAME] = answers.as_csv()
    for file_name, text in texts.items():
        write_text(folder / file_name, text, overwrite=False)
    return tuple(folder / file_name for file_name in texts)


def read_tidy_csv(folder: Path) -> ExportedTrials:
    """Read what `write_tidy_csv` wrote. Raises CannotReadError, UnusableFileError."""
    path = folder / FACTS_NAME
    try:
        facts = load_json(read_text(path))
    except ValueError as error:
        raise UnusableFileError(path, KIND, (str(error),)) from error
    if not isinstance(facts, dict):
        raise UnusableFileError(path, KIND, ("it is no JSON object",))
    table = folder / TRIALS_NAME
    return ExportedTrials(trials_in(table, KIND), read_text(folder / PROTOCOL_NAME), facts, (table,))
