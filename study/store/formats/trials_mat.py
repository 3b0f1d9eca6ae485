"""Trials as a MATLAB file (version 5): a structure of columns, beside protocol and provenance as text."""

import io
import json
from collections.abc import Mapping, Sequence
from enum import Enum
from pathlib import Path
from typing import Any

import numpy as np

from protocols.trial import Trial
from study.store.disk.atomic_write import write_atomically
from study.store.disk.csv_rows import columns
from study.store.formats.answer_table import AnswerTable
from study.store.formats.trial_columns import TRIAL_COLUMNS

NAME = "trials.mat"
"""Name of the exported file."""


def write_trials_mat(
    folder: Path,
    name: str,
    trials: Sequence[Trial],
    protocol_text: str,
    facts: Mapping[str, Any],
    answers: AnswerTable = AnswerTable(),  # noqa: B008  frozen
) -> tuple[Path, ...]:
    """Write numbers and booleans as columns (NaN for missing values), text as cells. Raises CannotWriteError."""
    from scipy.io import savemat

    written = io.BytesIO()
    savemat(
        written,
        {
            "study": name,
            "trials": {column: _column([getattr(trial, column) for trial in trials]) for column in columns(Trial)},
            "units": {column: TRIAL_COLUMNS[column][1] for column in columns(Trial)},
            "descriptions": {column: TRIAL_COLUMNS[column][0] for column in columns(Trial)},
            **_answers(answers),
            "protocol": protocol_text,
            "provenance": json.dumps(dict(facts), ensure_ascii=False),
        },
        oned_as="column",
        long_field_names=True,  # 63 characters; the key of a question alone may have 40
    )
    write_atomically(folder / NAME, written.getvalue(), overwrite=False)
    return (folder / NAME,)


def _answers(table: AnswerTable) -> dict[str, Any]:
    """A structure of cells, a row per session; nothing where no question is asked."""
    if not table.columns:
        return {}
    rows = [(subject, session, *answers) for subject, session, answers in table.rows]
    described = {column.name: column.description for column in table.columns}
    return {
        "answers": dict(zip(table.header, map(_cells, zip(*rows, strict=True)), strict=False)),
        "questions": described,
    }


def _column(values: Sequence[Any]) -> Any:
    plain = [value.value if isinstance(value, Enum) else value for value in values]
    if any(isinstance(value, str) for value in plain):
        return _cells(["" if value is None else value for value in plain])
    return np.array([np.nan if value is None else float(value) for value in plain])


def _cells(values: Sequence[str]) -> Any:
    cells = np.empty(len(values), dtype=object)
    cells[:] = values
    return cells
