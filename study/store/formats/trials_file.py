"""Read and write `trials.csv`: one row per presentation of a stimulus, derived from the session log.

The columns are the fields of `protocols.trial.Trial`; `trial_columns` states their meaning and unit. A table that is
read is also checked for values that no session can produce, because it may have been edited by hand.
"""

import math
from collections.abc import Iterable
from pathlib import Path

from protocols.trial import Trial
from study.store.disk.csv_rows import format_csv_table, list_columns, parse_csv_table
from study.store.disk.file_errors import UnusableFileError, convert_problems
from study.store.disk.text_file import read_text, write_text

TRIALS_NAME = "trials.csv"
"""Name of the file in the folder of a session."""
TRIALS_HEADER = list_columns(Trial)
"""Names of the columns, in the order of the file."""
KIND = "table of trials"
"""Name of this kind of file in error messages."""


def write_trials(path: Path, trials: Iterable[Trial]) -> None:
    """Write the table; an existing one is replaced. Raises CannotWriteError."""
    write_text(path, format_csv_table(trials, Trial), overwrite=True)


def read_trials(path: Path | str, kind: str = KIND) -> tuple[Trial, ...]:
    """Read the table. kind: name of such files in messages. Raises CannotReadError where the file cannot be read, and
    UnusableFileError where it is not a table of trials or where `find_trial_problems` finds a problem."""
    path = Path(path)
    with convert_problems(path, kind):
        trials = parse_csv_table(read_text(path), Trial)
    if problems := find_trial_problems(trials):
        raise UnusableFileError(path, kind, problems)
    return trials


def _find_non_finite_columns(trial: Trial) -> list[str]:
    """Find the names of the columns with an infinity or NaN, neither of which a session writes."""
    values = ((name, getattr(trial, name)) for name in TRIALS_HEADER)
    return [name for name, value in values if isinstance(value, float) and not math.isfinite(value)]


def find_trial_problems(trials: Iterable[Trial]) -> tuple[str, ...]:
    """Find values that no session can have written; describe each with its line number (the header is line 1): invalid
    direction, answer, level or frequency, a `correct` that contradicts the answer, values that are not finite."""
    problems = []
    for line_number, trial in enumerate(trials, start=2):
        if trial.direction_shown not in (1, 2):
            problems.append(f"line {line_number}: direction_shown is {trial.direction_shown}; directions are 1 and 2")
        if trial.answer not in (1, 2, None):
            problems.append(f"line {line_number}: answer is {trial.answer}; answers are 1, 2, or empty")
        if trial.correct != (None if trial.answer is None else trial.answer == trial.direction_shown):
            problems.append(f"line {line_number}: correct does not follow from direction_shown and answer")
        if not (trial.level_n > 0 and trial.frequency_hz > 0):
            problems.append(f"line {line_number}: level_n and frequency_hz must be above 0")
        problems += [
            f"line {line_number}: {name} is not finite; leave it empty if unknown"
            for name in _find_non_finite_columns(trial)
        ]
    return tuple(problems)
