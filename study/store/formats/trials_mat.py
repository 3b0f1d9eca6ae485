"""Export the trials of a study as a MATLAB file (MAT-file version 5), for analysis in MATLAB or Octave.

The file contains a structure `trials` with one field per column, structures `units` and `descriptions` with the same
fields, the answers to questionnaires, the study's name, the protocol as text, and the provenance as JSON text.
"""

import io
import json
from collections.abc import Mapping, Sequence
from enum import Enum
from pathlib import Path
from typing import Any

import numpy as np

from protocols.trial import Trial
from study.store.disk.atomic_write import write_atomically
from study.store.disk.csv_rows import list_columns
from study.store.formats.answer_table import AnswerTable
from study.store.formats.trial_columns import TRIAL_COLUMNS

TRIALS_MAT_NAME = "trials.mat"
"""Name of the exported file."""


def write_trials_mat(
    folder: Path,
    name: str,
    trials: Sequence[Trial],
    protocol_text: str,
    provenance: Mapping[str, Any],
    answers: AnswerTable = AnswerTable(),  # noqa: B008  frozen
) -> tuple[Path, ...]:
    """Write `trials.mat` into the folder and return a tuple with its path. Numbers, booleans and columns without any
    value become column vectors of double (NaN for a missing value), text becomes cell arrays. name: of the study;
    protocol_text: its file; provenance: JSON values. Raises AlreadyExistsError for an existing file, CannotWriteError
    where it cannot be written."""
    from scipy.io import savemat

    buffer = io.BytesIO()
    savemat(
        buffer,
        {
            "study": name,
            "trials": {
                column: _convert_column([getattr(trial, column) for trial in trials]) for column in list_columns(Trial)
            },
            "units": {column: TRIAL_COLUMNS[column][1] for column in list_columns(Trial)},
            "descriptions": {column: TRIAL_COLUMNS[column][0] for column in list_columns(Trial)},
            **_convert_answers(answers),
            "protocol": protocol_text,
            "provenance": json.dumps(dict(provenance), ensure_ascii=False),
        },
        oned_as="column",
        long_field_names=True,  # up to 63 characters instead of 31: the key of a question may have 40
    )
    write_atomically(folder / TRIALS_MAT_NAME, buffer.getvalue(), overwrite=False)
    return (folder / TRIALS_MAT_NAME,)


def _convert_answers(table: AnswerTable) -> dict[str, Any]:
    """Convert the answers to the variables `answers` (a cell array per column, with a row per session) and `questions`
    (descriptions); no variables if the table has no columns, an empty `answers` if it has no rows."""
    if not table.columns:
        return {}
    answer_rows = [(subject, session, *answers) for subject, session, answers in table.rows]
    descriptions = {column.name: column.description for column in table.columns}
    return {
        "answers": dict(zip(table.header, map(_make_cells, zip(*answer_rows, strict=True)), strict=False)),
        "questions": descriptions,
    }


def _convert_column(values: Sequence[Any]) -> Any:
    """Convert a column to an (n,) array of float with None as NaN; if any value is text, to cells with None as empty
    text."""
    cell_values = [value.value if isinstance(value, Enum) else value for value in values]
    if any(isinstance(value, str) for value in cell_values):
        return _make_cells(["" if value is None else value for value in cell_values])
    return np.array([np.nan if value is None else float(value) for value in cell_values])


def _make_cells(values: Sequence[str]) -> Any:
    """Make an (n,) array of objects, which scipy writes as a MATLAB cell array."""
    cells = np.empty(len(values), dtype=object)
    cells[:] = values
    return cells
