"""Trials as BIDS behaviour: per participant and session a TSV, one JSON for all of them, and the dataset's other files.

Brain Imaging Data Structure 1.10, "Behavioral experiments (with no neural recordings)". Missing values are n/a.
"""

import json
import re
import tomllib
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from protocols.trial import Trial
from study.session.views.form_views import parse_number
from study.store.disk.csv_rows import format_csv_table, list_columns
from study.store.disk.text_file import write_text
from study.store.formats.answer_table import AnswerColumn, AnswerTable
from study.store.formats.tidy_csv import FACTS_NAME
from study.store.formats.trial_columns import TRIAL_COLUMNS

BIDS_VERSION = "1.10.0"
"""Version of the BIDS standard that the dataset states."""
FILE_NAME_COLUMNS = ("subject", "session")
"""Columns of a trial that BIDS states in the name of the file instead of the table."""

PARTICIPANT_COLUMNS: dict[str, tuple[str, ...]] = {
    "age": (),
    "sex": ("male", "female", "other"),
    "handedness": ("left", "right", "ambidextrous"),
}
"""Columns of participants.tsv that are written, of those that BIDS defines, with the accepted values; an empty tuple
accepts numbers."""

TASK_DESCRIPTION = (
    "Each trial plays a sinusoidal vibration at the hand, along one of two orthogonal directions (a detection trial: "
    "in one of two intervals); the participant answers which."
)
"""`TaskDescription` of the tables' JSON."""
INSTRUCTIONS = (
    "Along which of the two directions (in a detection trial: in which of the two intervals) did the handle vibrate? "
    "Answer 1 or 2."
)
"""`Instructions` of the tables' JSON."""
README = """# {name}

{title}

Trials of a study of force directions, exported by hapteq: per participant and session one table below
`sub-*/ses-*/beh`, a row for each presentation. `task-*_beh.json` says what each column means and its unit;
`code/protocol.toml` is the protocol with every number of the study, in the form that `hapteq study --protocol` takes;
`code/{facts_name}` has its hash, the seed of each session, the devices and the versions of the programs.
"""
"""Text of the dataset's README, with the name of the dataset, the title of the protocol and `FACTS_NAME` as fields."""


def write_bids(
    folder: Path,
    name: str,
    trials: Sequence[Trial],
    protocol_text: str,
    facts: Mapping[str, Any],
    answers: AnswerTable = AnswerTable(),  # noqa: B008  frozen
) -> tuple[Path, ...]:
    """Write the dataset, and return the paths of its files. folder: existing and empty. name: of the dataset and, as a
    label, of the task. facts: provenance as JSON values, written below `code` as `FACTS_NAME`. Raises CannotWriteError
    where a file cannot be written, and OSError where a folder cannot."""
    task, readme = _make_label(name), README.format(name=name, title=_read_title(protocol_text), facts_name=FACTS_NAME)
    paths = [
        _write_json(folder / "dataset_description.json", {
            "Name": name, "BIDSVersion": BIDS_VERSION, "DatasetType": "raw",
            "GeneratedBy": [{"Name": "hapteq", "Version": str(facts.get("versions", {}).get("hapteq", ""))}],
        }),
        _write_text(folder / "README.md", readme),
        _write_text(folder / "CHANGES", "1.0.0\n  - As exported by hapteq.\n"),
        _write_text(folder / "code" / "protocol.toml", protocol_text),
        _write_json(folder / "code" / FACTS_NAME, facts),
        _write_json(folder / f"task-{task}_beh.json", {
            "TaskName": task,
            "TaskDescription": " ".join(
                part for part in (TASK_DESCRIPTION, _describe_target(protocol_text), _read_title(protocol_text)) if part
            ),
            "Instructions": INSTRUCTIONS,
            **{column: _describe_column(column) for column in list_columns(Trial) if column not in FILE_NAME_COLUMNS},
        }),
    ]  # fmt: skip
    subjects = list(dict.fromkeys(trial.subject for trial in trials))
    paths += _write_participants(folder, subjects, answers)
    for table in dict.fromkeys(column.table for column in answers.columns):
        paths += _write_phenotype(folder, table, answers)
    for session in dict.fromkeys(trial.session for trial in trials):
        rows = [trial for trial in trials if trial.session == session]
        sub, ses = f"sub-{_make_label(rows[0].subject)}", f"ses-{_make_label(session)}"  # BIDS entities
        paths.append(_write_text(folder / sub / ses / "beh" / f"{sub}_{ses}_task-{task}_beh.tsv", _format_tsv(rows)))
    return tuple(paths)


def _write_participants(folder: Path, subjects: Sequence[str], answers: AnswerTable) -> list[Path]:
    """Write participants.tsv and its JSON: the code, and the questions before the trials in `PARTICIPANT_COLUMNS`. A
    question with any answer that is not accepted there is left out. Of several sessions, the first answer counts."""
    participant_columns = [
        (column_index, column)
        for column_index, column in enumerate(answers.columns)
        if column.table == "before" and column.question.key in PARTICIPANT_COLUMNS
    ]
    values_by_key = {
        column.question.key: [
            next((row[2][column_index] for row in answers.rows if row[0] == subject and row[2][column_index]), "n/a")
            for subject in subjects
        ]
        for column_index, column in participant_columns
    }
    values_by_key = {
        key: values for key, values in values_by_key.items() if all(_is_valid_value(key, value) for value in values)
    }
    table_rows = [["participant_id", "code", *values_by_key]]
    table_rows += [[f"sub-{_make_label(subject)}", subject, *(values[row_index] for values in values_by_key.values())]
              for row_index, subject in enumerate(subjects)]  # fmt: skip
    text = "".join("\t".join(line) + "\n" for line in table_rows)
    descriptions = {
        column.question.key: _describe_answers(column)
        for _, column in participant_columns
        if column.question.key in values_by_key
    }
    return [
        _write_text(folder / "participants.tsv", text),
        _write_json(folder / "participants.json", {"code": {"Description": "Code as recorded"}, **descriptions}),
    ]


def _is_valid_value(key: str, value: str) -> bool:
    """Whether the value is accepted in the column `key`: n/a, one of its listed values, or a number where none are
    listed."""
    if value == "n/a":
        return True
    return value in PARTICIPANT_COLUMNS[key] if PARTICIPANT_COLUMNS[key] else parse_number(value) is not None


def _write_phenotype(folder: Path, table: str, answers: AnswerTable) -> list[Path]:
    """Write the answers to the questions of one table of the protocol ("before", "debrief"), a row per session, and
    the descriptions of their columns."""
    table_columns = [(index, column) for index, column in enumerate(answers.columns) if column.table == table]
    lines = [["participant_id", "session_id", *(column.question.key for _, column in table_columns)]]
    lines += [[f"sub-{_make_label(subject)}", f"ses-{_make_label(session)}",
               *(_format_cell(row[index]) for index, _ in table_columns)]
              for subject, session, row in answers.rows]  # fmt: skip
    descriptions = {"session_id": {"Description": "Session in which this was answered"}}
    descriptions |= {column.question.key: _describe_answers(column) for _, column in table_columns}
    text = "".join("\t".join(line) + "\n" for line in lines)
    phenotype = folder / "phenotype"
    return [_write_text(phenotype / f"{table}.tsv", text), _write_json(phenotype / f"{table}.json", descriptions)]


def _describe_answers(column: AnswerColumn) -> dict[str, Any]:
    """Describe a question as a column of BIDS: its text, and unit and levels where it has them."""
    question = column.question
    unit = {"Units": question.unit} if question.unit else {}
    return {"Description": question.question, **unit, **({"Levels": column.levels} if column.levels else {})}


def _format_cell(answer: str) -> str:
    """Format an answer as a cell, with single spaces for tabs and line breaks; n/a for an empty one."""
    return " ".join(answer.split()) or "n/a"


def _format_tsv(trials: Sequence[Trial]) -> str:
    """Format the trials as TSV. No value of a trial contains a comma or a quote, so that each line of their CSV can be
    split at its commas."""
    lines = [line.split(",") for line in format_csv_table(trials, Trial).splitlines()]
    column_indices = [
        column_index for column_index, column in enumerate(list_columns(Trial)) if column not in FILE_NAME_COLUMNS
    ]
    return "".join("\t".join(line[column_index] or "n/a" for column_index in column_indices) + "\n" for line in lines)


def _read_title(protocol_text: str) -> str:
    """Read the title of the protocol from its TOML text; empty where it has none."""
    return str(tomllib.loads(protocol_text).get("title", ""))


def _describe_target(protocol_text: str) -> str:
    """Describe the convergence level of an n-down, 1-up staircase, the n-th root of 1/2 (Levitt 1971); empty for
    the Psi method, and where the protocol states no `down_after_right`, or not 1 for `up_after_wrong`."""
    staircase_rule = tomllib.loads(protocol_text).get("staircase", {})
    is_psi = staircase_rule.get("bayesian", {}).get("trials", 0) > 0
    if is_psi or staircase_rule.get("up_after_wrong") != 1 or "down_after_right" not in staircase_rule:
        return ""
    p_correct = 0.5 ** (1 / staircase_rule["down_after_right"])
    return f"A staircase over the amplitude seeks the level at which {100 * p_correct:.2f} % of the answers are right."


def _describe_column(column: str) -> dict[str, str]:
    """Describe a column of the trials: its meaning, and its unit where it has one."""
    description, unit = TRIAL_COLUMNS[column]
    return {"Description": description, **({"Units": unit} if unit else {})}


def _make_label(text: str) -> str:
    """Make a BIDS label of a text: its ASCII letters and digits."""
    return re.sub(r"[^A-Za-z0-9]", "", text)


def _write_json(path: Path, value: Mapping[str, Any]) -> Path:
    """Write a JSON file, as `_write_text`."""
    return _write_text(path, json.dumps(value, indent=2, ensure_ascii=False) + "\n")


def _write_text(path: Path, text: str) -> Path:
    """Write a new text file and its missing folders, and return its path."""
    path.parent.mkdir(parents=True, exist_ok=True)
    write_text(path, text, overwrite=False)
    return path
