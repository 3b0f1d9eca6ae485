"""Export of a study's trials as tidy CSV: one table with a row per presentation, a data dictionary, protocol and facts.

Files of the folder: `trials.csv`, `dictionary.csv` (meaning and unit of the columns), `protocol.toml` (the study's own
text), `facts.json` (study, program, hashes), and `answers.csv` (`ANSWERS_NAME`). Tidy: one variable a column, one
observation a row (Wickham, Journal of Statistical Software 59 (2014), 10).
"""

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from protocols.trial import Trial
from study.store.disk.csv_rows import format_csv_line, format_csv_table, list_columns
from study.store.disk.file_errors import UnusableFileError
from study.store.disk.strict_json import load_json
from study.store.disk.text_file import read_text, write_text
from study.store.formats.answer_table import AnswerTable
from study.store.formats.psych_ds import ExportedTrials
from study.store.formats.trial_columns import TRIAL_COLUMNS
from study.store.formats.trials_file import read_trials

TRIALS_NAME, DICTIONARY_NAME, PROTOCOL_NAME, FACTS_NAME = "trials.csv", "dictionary.csv", "protocol.toml", "facts.json"
"""Names of the files of every export."""
ANSWERS_NAME = "answers.csv"
"""Answers to questionnaires; written only where their table has columns."""
KIND = "table of exported trials"
"""Name of the exported files in messages."""


def is_tidy_csv(folder: Path) -> bool:
    """Whether the folder contains the four files that `write_tidy_csv` writes in every export."""
    return all((folder / name).is_file() for name in (TRIALS_NAME, DICTIONARY_NAME, PROTOCOL_NAME, FACTS_NAME))


def write_tidy_csv(
    folder: Path,
    name: str,
    trials: Sequence[Trial],
    protocol_text: str,
    facts: Mapping[str, Any],
    answers: AnswerTable = AnswerTable(),  # noqa: B008  frozen
) -> tuple[Path, ...]:
    """Write the export and return the paths of its files. folder: an existing folder; name: name of the study;
    protocol_text: the protocol in TOML; facts: JSON values about the study and the program. Raises AlreadyExistsError
    where a file exists, CannotWriteError where one cannot be written."""
    dictionary_rows = [
        ["column", "description", "unit"],
        *([column, *TRIAL_COLUMNS[column]] for column in list_columns(Trial)),
    ]
    dictionary_rows += [[column.name, column.description, column.question.unit] for column in answers.columns]
    text_by_file_name = {
        TRIALS_NAME: format_csv_table(trials, Trial),
        DICTIONARY_NAME: "".join(format_csv_line(row) + "\n" for row in dictionary_rows),
        PROTOCOL_NAME: protocol_text,
        FACTS_NAME: json.dumps({"study": name, **facts}, indent=2, ensure_ascii=False) + "\n",
    }
    if answers.columns:
        text_by_file_name[ANSWERS_NAME] = answers.as_csv()
    for file_name, text in text_by_file_name.items():
        write_text(folder / file_name, text, overwrite=False)
    return tuple(folder / file_name for file_name in text_by_file_name)


def read_tidy_csv(folder: Path) -> ExportedTrials:
    """Read the trials, protocol and facts of an export by `write_tidy_csv`. Raises CannotReadError where a file cannot
    be read as text, UnusableFileError where trials or facts are not valid."""
    facts_path = folder / FACTS_NAME
    try:
        facts = load_json(read_text(facts_path))
    except ValueError as error:
        raise UnusableFileError(facts_path, KIND, (str(error),)) from error
    if not isinstance(facts, dict):
        raise UnusableFileError(facts_path, KIND, ("it is no JSON object",))
    trials_path = folder / TRIALS_NAME
    return ExportedTrials(read_trials(trials_path, KIND), read_text(folder / PROTOCOL_NAME), facts, (trials_path,))
