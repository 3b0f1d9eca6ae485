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
from study.store.formats.trial_columns import TRIAL_COLUMNS

NAME = "trials.mat"


def write_trials_mat(
    folder: Path, name: str, trials: Sequence[Trial], protocol_text: str, facts: Mapping[str, Any]
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
            "protocol": protocol_text,
            "provenance": json.dumps(dict(facts), ensure_ascii=False),
        },
        oned_as="column",
    )
    write_atomically(folder / NAME, written.getvalue(), overwrite=False)
    return (folder / NAME,)


def _column(values: Sequence[Any]) -> Any:
    plain = [value.value if isinstance(value, Enum) else value for value in values]
    if any(isinstance(value, str) for value in plain):
        cells = np.empty(len(plain), dtype=object)
        cells[:] = ["" if value is None else value for value in plain]
        return cells
    return np.array([np.nan if value is None else float(value) for value in plain])
