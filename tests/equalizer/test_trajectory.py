import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from equalizer.signals.signal import Signal
from equalizer.tracking.feedforward.trajectory import (
    FORCES,
    TRAJECTORY,
    TableError,
    Trajectory,
    format_trajectory_csv,
    parse_trajectory,
    require_rate,
)

GOOD = "time_s,ax,ay,az\n0.0,1,2,3\n0.001,4,5,6\n0.002,7,8,9\n"


def forces(samples, rate_hz=1000.0):
    return Signal(samples, rate_hz, "force", "N", ("fx", "fy", "fz"))


def the_problem(text):
    with pytest.raises(TableError) as refused:
        parse_trajectory(text)
    (problem,) = refused.value.problems
    return problem


def test_a_table_of_accelerations_is_read():
    read = parse_trajectory(GOOD)
    assert read.kind is TRAJECTORY
    assert (read.signal.sample_rate_hz, read.signal.unit, read.start_s) == (1000.0, "m/s^2", 0.0)
    assert read.signal.samples.tolist() == [[1, 2, 3], [4, 5, 6], [7, 8, 9]]


@given(
    st.lists(st.tuples(*[st.floats(-1e9, 1e9)] * 3), min_size=2, max_size=30),
    st.sampled_from([100.0, 1000.0, 44100.0]),
    st.floats(0.0, 100.0),
)
@settings(max_examples=50, deadline=None)
def test_forces_are_read_back_to_the_last_digit(rows, rate_hz, start_s):
    written = Trajectory(forces(np.array(rows), rate_hz), start_s)
    read = parse_trajectory(format_trajectory_csv(written))
    assert read.kind is FORCES
    assert np.array_equal(read.signal.samples, written.signal.samples)
    assert (read.signal.sample_rate_hz, read.start_s) == (rate_hz, start_s)


def test_windows_line_ends_blanks_in_the_header_and_empty_lines_at_the_end_do_no_harm():
    assert len(parse_trajectory(GOOD.replace("\n", "\r\n").replace("ax,ay", "ax, ay") + "\r\n\r\n").signal) == 3


def test_a_rate_that_is_no_whole_number_is_kept():
    text = format_trajectory_csv(Trajectory(forces(np.zeros((100, 3)), 610.35)))
    assert parse_trajectory(text).signal.sample_rate_hz == pytest.approx(610.35, rel=1e-9)


@pytest.mark.parametrize(
    ("old", "new", "problem"),
    [
        ("time_s", "t", "line 1 reads 't,ax,ay,az'; allowed is time_s,ax,ay,az or time_s,fx,fy,fz"),
        ("4,5,6", "4,5", "line 3 has 3 fields, but the header names 4"),
        ("4,5,6", "4,five,6", "line 3 reads '0.001,4,five,6'; every field must be a number"),
        ("4,5,6", "4,nan,6", "line 3 reads '0.001,4,nan,6'; every field must be a number"),
        ("0.001,4,5,6", "", "line 3 has 0 fields, but the header names 4"),
        ("0.002", "0.001", "time_s does not grow at row 3 (line 4)"),
        ("0.002", "0.0021", "time_s is not at a constant rate: the step to row 2 (line 3) is 0.001 s, the mean"),
        ("\n0.001,4,5,6\n0.002,7,8,9", "", "there are 1 rows of numbers; a rate needs two or more"),
    ],
)  # fmt: skip
def test_every_fault_is_named_with_its_line(old, new, problem):
    assert the_problem(GOOD.replace(old, new, 1)).startswith(problem)


def test_an_empty_text_has_no_header():
    assert the_problem("").startswith("line 1 reads ''; allowed is time_s,ax,ay,az")


def test_a_text_that_is_no_table_is_refused():
    assert the_problem(GOOD.replace("4,5,6", "4\r5,6")).startswith("this is not CSV: new-line character seen")


def test_of_many_faults_the_first_are_named_and_the_rest_counted():
    with pytest.raises(TableError) as refused:
        parse_trajectory("time_s,ax,ay,az\n" + "0,0,0\n" * 20)
    assert len(refused.value.problems) == 6
    assert refused.value.problems[-1] == "and 15 lines more like these"


def test_missing_samples_are_not_written():
    with pytest.raises(TableError, match="a table of forces cannot hold missing or infinite values"):
        format_trajectory_csv(Trajectory(forces(np.full((3, 3), np.nan))))


def test_other_signals_make_no_table():
    with pytest.raises(
        ValueError, match="a table of trajectory holds acceleration in m/s\\^2, channels ax, ay, az, not pos"
    ):
        Trajectory(Signal(np.zeros((3, 1)), 1000.0, "position", "m", ("x",)))


def test_the_rate_of_the_model_is_asked_for():
    require_rate(parse_trajectory(GOOD), 1000.0)
    with pytest.raises(TableError, match="the rows are at 1000 Hz, but the model is at 500 Hz; resample them to it"):
        require_rate(parse_trajectory(GOOD), 500.0)


def test_a_rate_that_differs_by_rounding_becomes_that_of_the_model():
    """Exactly: the rates of a signal and a model are compared without a tolerance."""
    rows = "".join(f"{k / 999.7:.6f},0,0,{k}\n" for k in range(1000))
    table = parse_trajectory(f"time_s,ax,ay,az\n{rows}")
    assert table.signal.sample_rate_hz != 999.7
    assert require_rate(table, 999.7).signal.sample_rate_hz == 999.7
