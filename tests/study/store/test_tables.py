from dataclasses import fields, replace

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from analysis.thresholds import Threshold
from protocols.trial import Phase, Trial, TrialStatus
from study.store.csv_rows import CsvError, as_written_in, in_words, rows_from_csv, rows_to_csv
from study.store.file_errors import UnusableFileError
from study.store.thresholds_file import THRESHOLDS_HEADER, read_thresholds, write_thresholds
from study.store.trials_file import TRIALS_HEADER, read_trials, write_trials

CONTRACT = (
    "subject, session, run, trial, attempt, phase, frequency_hz, level_n, direction_shown, answer, correct, reversal, "
    "response_time_s, delivered_mps2, off_axis_mps2, displacement_mm, missed_ticks, felt, status"
)
TRIAL = Trial(
    "P01", "P01_001", 1, 3, 1, Phase.TEST, 25.0, 0.1 + 0.2, 1, 1, True, False, 1.5, 2.5, 0.01, 0.3, 0, False,
    TrialStatus.OK, 135.0,
)  # fmt: skip

floats = st.floats(allow_nan=False)
trials = st.builds(
    Trial,
    subject=st.text(st.characters(exclude_categories=("Cs", "Cc")), max_size=8),
    level_n=floats,
    frequency_hz=floats,
    response_time_s=st.none() | floats,
    delivered_mps2=st.none() | floats,
    off_axis_mps2=st.none() | floats,
    displacement_mm=st.none() | floats,
)


@given(st.lists(trials, max_size=5))
@settings(max_examples=60, deadline=None)
def test_rows_are_read_back_to_the_last_digit(rows):
    assert rows_from_csv(rows_to_csv(rows, Trial), Trial) == tuple(rows)


def test_the_columns_of_trials_begin_as_in_the_contract():
    assert ", ".join(TRIALS_HEADER[:19]) == CONTRACT


def test_the_columns_of_thresholds_begin_as_in_the_contract():
    assert THRESHOLDS_HEADER[:8] == (
        "subject", "frequency_hz", "threshold_n", "threshold_db", "censored", "reversals", "trials", "cap_reversals",
    )  # fmt: skip


def test_a_row_is_plain_text():
    unanswered = replace(TRIAL, answer=None, correct=None, felt=None)
    first, second, third = rows_to_csv([TRIAL, unanswered], Trial).splitlines()
    assert first == ",".join(TRIALS_HEADER)
    assert second == "P01,P01_001,1,3,1,test,25.0,0.30000000000000004,1,1,true,false,1.5,2.5,0.01,0.3,0,false,ok,135.0,"
    assert third == "P01,P01_001,1,3,1,test,25.0,0.30000000000000004,1,,,false,1.5,2.5,0.01,0.3,0,,ok,135.0,"


def test_tables_are_rewritten_at_will(tmp_path):
    write_trials(tmp_path / "trials.csv", [TRIAL])
    write_trials(tmp_path / "trials.csv", [TRIAL, TRIAL])
    assert read_trials(tmp_path / "trials.csv") == (TRIAL, TRIAL)


def test_thresholds_go_to_disk_and_back(tmp_path):
    row = Threshold(
        **{field.name: None for field in fields(Threshold)}
        | {"subject": "P01", "frequency_hz": 35.0, "threshold_n": 1.25, "censored": True, "complete": True}
        | {name: 3 for name in ("reversals", "trials", "cap_reversals", "trials_at_cap", "pushes_against_cap")}
        | {"session": "P01_001", "run": 1, "spoiled_trials": 0, "measured_reversals": 0}
    )
    write_thresholds(tmp_path / "thresholds.csv", [row])
    assert read_thresholds(tmp_path / "thresholds.csv") == (row,)


def test_a_table_of_before_a_column_was_added_agrees_with_rows_of_today():
    before = "\n".join(line.rpartition(",")[0] for line in rows_to_csv((TRIAL,), Trial).splitlines()) + "\n"
    (read,) = rows_from_csv(before, Trial)
    assert as_written_in(before, (TRIAL,), Trial) == (read,)
    last = fields(Trial)[-1]
    changed = replace(TRIAL, **{last.name: "something else", "level_n": 9.0})
    assert as_written_in(before, (changed,), Trial) == (replace(read, level_n=9.0),)
