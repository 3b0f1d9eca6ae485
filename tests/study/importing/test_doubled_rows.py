"""Rows with one time stamp: the same values are left out and counted, other values are refused."""

import numpy as np
import pytest

from tests.recording_maps import N, U, Y, built, map_text, refusal

CLOCK = map_text('time = "t"\ntime_unit = "ms"')
T = np.arange(float(N))


@pytest.mark.parametrize("twice", [[5], [0, 7, N - 1], [3, 3, 3]])
def test_rows_that_were_logged_twice_are_left_out_and_counted(files, twice):
    rows = np.sort(np.r_[np.arange(N), twice])
    found = built(CLOCK, files(t=T[rows], u=U[rows], y=Y[rows], nr=np.arange(len(rows))))
    np.testing.assert_array_equal(found.recording.command.samples[:, 0], U)
    count = f"{len(twice)} row{'s' if len(twice) > 1 else ''}"
    said = f"Clock 'clock': {count} logged twice (the same stamp, the same values) left out."
    assert said in found.notes


def test_missing_samples_are_the_same_value(files):
    rows = np.sort(np.r_[np.arange(N), 9])
    y = np.where(np.arange(N) == 9, np.nan, Y)
    assert len(built(CLOCK, files(t=T[rows], u=U[rows], y=y[rows])).recording) == N


@pytest.mark.parametrize("other", ["u", "y"])
def test_one_stamp_with_other_values_is_refused_with_the_key_that_mends_it(files, other):
    rows = np.sort(np.r_[np.arange(N), 5, 9])
    arrays = {"t": T[rows], "u": U[rows], "y": Y[rows]}
    arrays[other] = arrays[other] + (np.arange(len(rows)) == 6)
    said = refusal(CLOCK, files(**arrays))
    assert "stands still at sample 6" in said
    assert "rate_hz = " in said
    assert "where a sample was logged twice with other values, remove either of the two" in said


def test_rows_are_not_compared_where_the_map_states_the_rate(files):
    found = built(map_text("rate_hz = 1000"), files(u=np.ones(N), y=np.ones(N)))
    assert len(found.recording) == N
    assert not any("logged twice" in note for note in found.notes)
