from dataclasses import replace

import pytest

from analysis.diagnosis.localisation.mismatch_cells import MismatchCell
from analysis.diagnosis.localisation.mismatch_rows import MOST_ROWS, StateMismatch, list_mismatch_rows
from analysis.diagnosis.localisation.state_regions import StateRegion


def make_cell(share, p_value=1e-9, amplitude=1.0):
    return MismatchCell("ax", "acceleration", "fx", (2.0, 4.0), amplitude, share, 1.0, 5.0, 0.02, p_value, p_value, 6.0)


def make_state(share, p_value):
    return StateMismatch(
        "ax", "fx", (2.0, 256.0), StateRegion("velocity", "v", "size", share, 0.1, p_value, "near v = 0")
    )


def test_rows_come_by_what_they_miss_of_the_signal_and_only_where_significant():
    rows = list_mismatch_rows([make_cell(0.1, amplitude=2.0), make_cell(0.3), make_cell(0.9, p_value=0.02)])
    assert [row.share for row in rows] == [0.3, 0.1]
    assert rows[0].state is None
    assert rows[0].amplitude == 1.0


def test_a_band_without_signal_comes_after_a_smaller_share_of_the_loud_one():
    faint = replace(make_cell(0.9), band_hz=(256.0, 512.0), rms=0.009, signal_rms=0.01)
    assert faint.share == pytest.approx(0.9)
    assert [row.band_hz[0] for row in list_mismatch_rows([faint, make_cell(0.1)])] == [2.0, 256.0]
    loud = replace(faint, rms=0.9, signal_rms=1.0)
    assert [row.band_hz[0] for row in list_mismatch_rows([loud, make_cell(0.1)])] == [256.0, 2.0]


def test_a_prediction_that_is_worse_than_none_is_a_share_of_one():
    assert list_mismatch_rows([make_cell(2.5)])[0].share == 1.0


def test_states_are_rows_over_all_levels():
    rows = list_mismatch_rows([make_cell(0.1)], [make_state(0.6, 1e-4), make_state(0.9, 0.5)])
    assert [row.state for row in rows] == ["near v = 0", None]
    assert rows[0].amplitude is None


def test_a_level_that_is_not_known_is_none():
    assert list_mismatch_rows([make_cell(0.1, amplitude=0.0)])[0].amplitude is None


def test_no_more_rows_are_kept_than_a_page_holds():
    rows = list_mismatch_rows(
        [make_cell(0.1 + k / 1000, amplitude=1.0 + k) for k in range(100)], [make_state(0.01, 1e-4)]
    )
    assert len(rows) == MOST_ROWS
    assert rows[0].state == "near v = 0"
    assert list_mismatch_rows([]) == ()


def test_parts_with_the_same_mismatch_are_one_row():
    """A row does not name its part; the share is that of all parts together."""
    parts = [replace(make_cell(share), part=part) for part, share in enumerate((0.3, 0.4))]
    (row,) = list_mismatch_rows(parts)
    assert row.share == pytest.approx((0.5 * (0.3**2 + 0.4**2)) ** 0.5)
    assert len(list_mismatch_rows([*parts, make_cell(0.3, amplitude=2.0)])) == 2


def test_a_level_that_was_recorded_again_does_not_change_the_order_of_rows():
    """Rows are ordered by the mismatch over the channel's signal, which repeats do not enlarge."""
    other_channel = replace(make_cell(0.35), output="ay")
    once = list_mismatch_rows([make_cell(0.4), other_channel])
    again = list_mismatch_rows([*(replace(make_cell(0.4), part=part) for part in range(4)), other_channel])
    assert [row.output for row in once] == [row.output for row in again] == ["ax", "ay"]
