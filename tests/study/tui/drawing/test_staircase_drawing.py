"""A staircase as text: where levels stand, and how marks tell what happened."""

from dataclasses import replace

import pytest

from study.session.views.archive_views import Staircase
from study.tui.drawing.staircase_drawing import (
    LABEL_COLUMNS,
    PEAK_MARK,
    RIGHT_MARK,
    VALLEY_MARK,
    WRONG_MARK,
    draw_staircase,
    summarise_staircase,
)

SMALL = Staircase("Run", (1.0, 1.0, 0.5, 1.0), (True, True, False, True), (False, True, True, False), 0.75, 3.0)


def marks(lines):
    return {(column, row): c for row, text in enumerate(lines) for column, c in enumerate(text) if c in "○×▼▲"}


def test_every_trial_has_its_mark_and_a_higher_level_stands_higher():
    lines = draw_staircase(SMALL, 60, 12)
    by_column = dict(sorted((column, (row, c)) for (column, row), c in marks(lines).items()))
    assert [c for _, c in by_column.values()] == [RIGHT_MARK, PEAK_MARK, VALLEY_MARK, RIGHT_MARK]
    rows = [row for row, _ in by_column.values()]
    assert rows[0] == rows[1] == rows[3] < rows[2]


def test_a_wrong_answer_that_turns_nothing_is_a_cross():
    lines = draw_staircase(replace(SMALL, reversals=(False,) * 4), 60, 12)
    assert sorted(marks(lines).values()) == sorted([RIGHT_MARK, RIGHT_MARK, WRONG_MARK, RIGHT_MARK])


def test_cap_threshold_and_lowest_level_have_their_numbers():
    lines = draw_staircase(SMALL, 60, 12)
    labels = [text[:LABEL_COLUMNS].strip() for text in lines[:-1] if text[:LABEL_COLUMNS].strip()]
    assert labels == ["3 N", "0.75 N", "0.425 N"]
    assert lines[-1].split() == ["1", "trial", "4"]


@pytest.mark.parametrize("level_n", [0.05, 0.0123, 0.00123, 0.0000123])
def test_long_labels_shift_no_line(level_n):
    lines = draw_staircase(replace(SMALL, levels_n=(level_n,) * 4, threshold_n=None), 60, 12)
    labelled_lines = [text for text in lines if " N" in text]
    assert len(labelled_lines) == 2
    assert all(text.ljust(60)[LABEL_COLUMNS - 2 : LABEL_COLUMNS] == "N " for text in labelled_lines)


@pytest.mark.parametrize("size", [(LABEL_COLUMNS + 8, 6), (20, 6), (60, 12), (200, 40)])
@pytest.mark.parametrize("trials", [1, 2, 60, 400])
def test_it_fits_into_its_room(size, trials):
    levels = tuple(0.1 + (n % 7) * 0.4 for n in range(trials))
    staircase = Staircase("Run", levels, (True,) * trials, (False,) * trials, None, 3.0)
    lines = draw_staircase(staircase, *size)
    assert len(lines) == size[1]
    assert max(map(len, lines)) <= size[0]


def test_levels_at_and_above_the_cap_stay_in_the_picture():
    lines = draw_staircase(replace(SMALL, levels_n=(3.0, 3.5, 3.0, 3.0)), 60, 12)
    assert {row for _, row in marks(lines)} == {0}


def test_without_room_or_answers_it_says_so():
    assert draw_staircase(SMALL, 10, 3) == ("No room to draw.",)
    assert draw_staircase(Staircase("Run", (), (), (), None, 3.0), 60, 12) == ("Nothing was answered in this run.",)


def test_the_summary_counts():
    assert summarise_staircase(SMALL) == "4 trials, 3 right, 2 reversals; threshold 0.750 N."
    assert summarise_staircase(replace(SMALL, threshold_n=None)) == "4 trials, 3 right, 2 reversals."
