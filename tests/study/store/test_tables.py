from dataclasses import fields, replace

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from analysis.psychophysics.thresholds import Threshold
from protocols.trial import Phase, Trial, TrialStatus
from study.store.disk.csv_rows import CsvError, describe_type, drop_absent_columns, format_csv_table, parse_csv_table
from study.store.disk.file_errors import UnusableFileError
from study.store.formats.thresholds_file import THRESHOLDS_HEADER, read_thresholds, write_thresholds
from study.store.formats.trials_file import TRIALS_HEADER, read_trials, write_trials

CONTRACT = (
    "subject, session, run, trial, attempt, phase, frequency_hz, level_n, direction_shown, answer, correct, reversal, "
    "response_time_s, delivered_mps2, off_axis_mps2, displacement_mm, missed_ticks, felt, status"
)
TRIAL = Trial(
    "P01", "P01_001", 1, 3, 1, Phase.TEST, 25.0, 0.1 + 0.2, 1, 1, True, False, 1.5, 2.5, 0.01, 0.3, 0, False,
    TrialStatus.OK, 135.0,
)  # fmt: skip

LATER = (
    ",wanted_mps2,void_cause,repeat_cause,late_ticks,latest_s,onset_s,harmonics_mps2,nominal_n,lost_packets,"
    "garbled_bytes,acceleration_missing"
)
"""Columns that earlier versions did not write, the newest last."""
TIMES = ("late_ticks", "latest_s", "onset_s")

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
    assert parse_csv_table(format_csv_table(rows, Trial), Trial) == tuple(rows)


def test_the_columns_of_trials_begin_as_in_the_contract():
    assert ", ".join(TRIALS_HEADER[:19]) == CONTRACT


def test_the_columns_of_thresholds_begin_as_in_the_contract():
    assert THRESHOLDS_HEADER[:8] == (
        "subject", "frequency_hz", "threshold_n", "threshold_db", "censored", "reversals", "trials", "cap_reversals",
    )  # fmt: skip


def test_a_row_is_plain_text():
    unanswered = replace(TRIAL, answer=None, correct=None, felt=None)
    first, second, third = format_csv_table([TRIAL, unanswered], Trial).splitlines()
    assert first == ",".join(TRIALS_HEADER)
    assert (
        second
        == "P01,P01_001,1,3,1,test,25.0,0.30000000000000004,1,1,true,false,1.5,2.5,0.01,0.3,0,false,ok,135.0,,,,,,,,,,,"
    )
    assert third == "P01,P01_001,1,3,1,test,25.0,0.30000000000000004,1,,,false,1.5,2.5,0.01,0.3,0,,ok,135.0,,,,,,,,,,,"


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
        | {"repeats_at_will": 3, "repeat_rate": 0.05, "asked_often": True}
    )
    write_thresholds(tmp_path / "thresholds.csv", [row])
    assert read_thresholds(tmp_path / "thresholds.csv") == (row,)


def test_a_table_of_before_a_column_was_is_still_read():
    lines = format_csv_table([TRIAL], Trial).splitlines()
    older = "\n".join(line.removesuffix(LATER).removesuffix(",,,,,,,,,,,") for line in lines)
    assert parse_csv_table(older, Trial) == (TRIAL,)
    foreign = older.replace("angle_deg", "remark").replace("135.0", "late")
    assert parse_csv_table(foreign, Trial) == (replace(TRIAL, angle_deg=None),)


@pytest.mark.parametrize("absent", [LATER[LATER.index(name) - 1 :] for name in TIMES])
def test_a_table_of_before_late_ticks_were_written_down_says_nothing_of_them(absent):
    late = replace(TRIAL, late_ticks=3, latest_s=0.0042, onset_s=12.5)
    assert parse_csv_table(format_csv_table([late], Trial), Trial) == (late,)
    header, row = format_csv_table([late], Trial).splitlines()
    columns_absent = absent.count(",")
    older = f"{header.removesuffix(absent)}\n{row.rsplit(',', columns_absent)[0]}\n"
    (read,) = parse_csv_table(older, Trial)
    known = TIMES[: TIMES.index(absent.split(",")[1])]
    assert read == replace(TRIAL, **{name: getattr(late, name) for name in known})


def test_columns_after_the_known_ones_do_no_harm():
    lines = format_csv_table([TRIAL], Trial).splitlines()
    assert parse_csv_table(f"{lines[0]},more\r\n{lines[1]},1\r\n", Trial) == (TRIAL,)


@pytest.mark.parametrize("odd", ["\r", "a\rb", "a\nb", "\r\n", 'a"b', "a,b", " ", "", "\x00"])
def test_a_name_may_hold_what_tables_are_made_of(odd):
    row = replace(TRIAL, session=odd)
    assert parse_csv_table(format_csv_table([row], Trial), Trial) == (row,)


def test_a_text_that_is_no_table_is_refused():
    with pytest.raises(CsvError, match="this is not CSV: new-line character seen in unquoted field"):
        parse_csv_table("subject\rsession,x\n", Trial)


@pytest.mark.parametrize(
    ("old", "new", "problem"),
    [
        ("frequency_hz", "freq", "column 7 of the header is 'freq'; it must be 'frequency_hz' (of subject, session"),
        (
            f",status,angle_deg{LATER}\n",
            "\n",
            "column 19 of the header is missing; it must be 'status'",
        ),
        (",135.0,,,,,,,,,,,\n", "\n", "line 2 has 19 fields, but the header names 31"),
        (",3,1,test", ",three,1,test", "line 2, column trial: 'three' is not a whole number"),
        ("25.0", "high", "line 2, column frequency_hz: 'high' is not a number"),
        ("25.0", "", "line 2, column frequency_hz: it is empty, but a value is needed"),
        ("true", "yes", "line 2, column correct: 'yes' is neither true nor false"),
        (",test,", ",pause,", "line 2, column phase: 'pause' is none of training, detection, test, catch"),
        ("25.0,0.3", "25.0,-0.3", "line 2: level_n and frequency_hz must be above 0"),
        ("4,1,1,true", "4,3,1,true", "line 2: direction_shown is 3; directions are 1 and 2"),
        ("4,1,1,true", "4,1,7,false", "line 2: answer is 7; answers are 1, 2, or empty"),
        ("4,1,1,true", "4,1,1,false", "line 2: correct does not follow from direction_shown and answer"),
    ],
)
def test_every_fault_of_a_table_is_named_with_its_line(tmp_path, old, new, problem):
    (tmp_path / "trials.csv").write_text(format_csv_table([TRIAL], Trial).replace(old, new, 1))
    with pytest.raises(UnusableFileError) as refused:
        read_trials(tmp_path / "trials.csv")
    assert any(found.startswith(problem) for found in refused.value.problems), refused.value.problems


def test_a_faulty_table_of_thresholds_is_an_error_of_the_study(tmp_path):
    (tmp_path / "thresholds.csv").write_text("subject,hz\n")
    with pytest.raises(
        UnusableFileError, match=r"thresholds\.csv is not a usable table of thresholds. Column 2 of the"
    ):
        read_thresholds(tmp_path / "thresholds.csv")


def test_an_empty_text_has_no_header():
    with pytest.raises(CsvError, match="column 1 of the header is missing; it must be 'subject'"):
        parse_csv_table("", Trial)


def test_of_many_faults_the_first_are_named_and_the_rest_counted():
    with pytest.raises(CsvError) as refused:
        parse_csv_table(",".join(TRIALS_HEADER) + "\n" + "x\n" * 20, Trial)
    assert len(refused.value.problems) == 9
    assert refused.value.problems[-1] == "and 12 more problems of this kind"


def test_columns_are_described_for_people():
    assert describe_type(bool | None) == "`true` or `false`, or empty"
    assert describe_type(Phase) == "`training`, `detection`, `test`, `catch`"


def test_a_table_of_before_a_column_was_added_agrees_with_rows_of_today():
    before = "\n".join(line.rpartition(",")[0] for line in format_csv_table((TRIAL,), Trial).splitlines()) + "\n"
    (read,) = parse_csv_table(before, Trial)
    assert drop_absent_columns(before, (TRIAL,), Trial) == (read,)
    last = fields(Trial)[-1]
    changed = replace(TRIAL, **{last.name: "something else", "level_n": 9.0})
    assert drop_absent_columns(before, (changed,), Trial) == (replace(read, level_n=9.0),)


@pytest.mark.parametrize("name", ["level_n", " answer", "mine"])
def test_a_column_that_is_there_twice_is_refused(name, tmp_path):
    """Neither of both is taken; further columns of other names stay allowed, and so do empty ones at the end."""
    header, row = format_csv_table([TRIAL], Trial).splitlines()
    path = tmp_path / "trials.csv"
    path.write_text(f"{header},mine,{name},,\n{row},1,2,,\n")
    with pytest.raises(UnusableFileError, match=f"names the column '{name.strip()}' twice"):
        read_trials(path)
    path.write_text(f"{header},mine,other,,\n{row},1,2,,\n")
    assert read_trials(path) == (TRIAL,)
