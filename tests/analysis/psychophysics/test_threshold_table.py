from dataclasses import replace

import pytest

from analysis.psychophysics.threshold_table import tabulate_thresholds
from analysis.psychophysics.thresholds import compute_thresholds


@pytest.fixture
def rows(simulate_study, rule):
    return compute_thresholds(simulate_study(subjects=3), rule)


FREQUENCIES = (5.0, 15.0, 25.0, 35.0, 45.0)


def test_each_participant_has_one_value_per_frequency(rows):
    table = tabulate_thresholds(rows, FREQUENCIES)
    assert table.subjects == ("s01", "s02", "s03")
    assert list(table.group_by_frequency()) == ["5 Hz", "15 Hz", "25 Hz", "35 Hz", "45 Hz"]
    for row in rows:
        at = table.subjects.index(row.subject), table.frequencies_hz.index(row.frequency_hz)
        assert table.values[at[0]][at[1]] == row.threshold_n
        assert table.censored[at[0]][at[1]] is row.censored
    assert table.list_gaps() == ()


def test_an_incomplete_run_leaves_a_gap(rows):
    unfinished = [replace(row, complete=False) if row.subject == "s02" else row for row in rows]
    table = tabulate_thresholds(unfinished, FREQUENCIES)
    assert table.list_gaps() == tuple(("s02", frequency) for frequency in FREQUENCIES)
    assert table.group_by_frequency()["5 Hz"][1] is None


def test_the_first_completed_run_counts_and_the_second_is_named(rows):
    again = replace(rows[0], session="2", run=1, threshold_n=0.1)
    table = tabulate_thresholds([*rows, again], FREQUENCIES)
    assert table.values == tabulate_thresholds(rows, FREQUENCIES).values
    assert table.notes == (
        f"s01 completed more than one run at {rows[0].frequency_hz:g} Hz; the threshold is that of the first "
        "(session 1), not of run 1 of session 2. A model of all answers takes the answers of both.",
    )


def test_answers_of_a_second_detection_run_enter_no_model(rows):
    (note,) = tabulate_thresholds([*rows, replace(rows[0], session="2", run=1)], FREQUENCIES, is_detection=True).notes
    assert "completed more than one detection run at" in note and "model" not in note


def test_a_frequency_of_another_protocol_is_named(rows):
    table = tabulate_thresholds([replace(rows[0], frequency_hz=80.0)], FREQUENCIES)
    assert table.notes == ("s01 has a run at 80 Hz, which the protocol does not name.",)


def test_the_same_table_in_decibel_or_as_delivered(rows):
    for quantity in ("threshold_db", "threshold_mps2", "threshold_mm"):
        table = tabulate_thresholds(rows, FREQUENCIES, quantity)
        assert table.values[0][table.frequencies_hz.index(rows[0].frequency_hz)] == getattr(rows[0], quantity)


def test_no_run_at_all_is_a_table_without_rows():
    table = tabulate_thresholds((), FREQUENCIES)
    assert table.subjects == ()
    assert table.group_by_frequency() == {f"{f:g} Hz": () for f in FREQUENCIES}
