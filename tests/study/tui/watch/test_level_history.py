"""The growing staircase as text."""

import pytest

from study.session.watching.watch_view import StaircasePoint
from study.tui.watch.level_history import LEGEND, draw_level_history

SIZE = (50, 12)


def point(trial: int, level_n: float, correct: bool = True, reversal: bool = False) -> StaircasePoint:
    return StaircasePoint(trial, level_n, correct, reversal)


def drawn(points, next_n=None, cap_n=3.0, size=SIZE) -> list[str]:
    return draw_level_history(points, next_n, cap_n, size).plain.split("\n")


def test_it_fills_its_room_and_no_more():
    points = [point(i, 1.0 + 0.01 * i, correct=i % 3 > 0) for i in range(300)]
    for size in [(20, 6), (50, 12), (200, 40)]:
        lines = drawn(points, 1.0, size=size)
        assert len(lines) == size[1]
        assert max(map(len, lines)) <= size[0]


def test_cap_and_present_level_are_named():
    lines = drawn([point(0, 1.0), point(1, 1.58)], 1.58)
    assert lines[0].startswith("    3 N ⠒⠒")
    assert any(line.startswith(" 1.58 N") for line in lines)
    assert lines[-1].strip() == LEGEND


def test_marks_tell_right_wrong_turns_and_what_is_next_without_colour():
    points = [point(0, 2.0), point(1, 2.0, False, True), point(2, 2.5), point(3, 2.5, True, True)]
    text = "".join(drawn(points, 2.0)[:-1])
    assert [text.count(mark) for mark in "○×▼▲?"] == [2, 0, 1, 1, 1]
    assert "×" in "".join(drawn([point(0, 2.0, correct=False)])[:-1])


def test_a_stronger_level_is_drawn_higher():
    lines = drawn([point(0, 1.0, correct=False), point(1, 2.0)])
    assert next(i for i, line in enumerate(lines) if "○" in line) < next(
        i for i, line in enumerate(lines) if "×" in line
    )


def test_levels_at_the_cap_and_very_low_ones_stay_inside():
    for level_n in (3.0, 0.001):
        marks = [line for line in drawn([point(0, level_n)])[:-1] if "○" in line]
        assert len(marks) == 1


def test_turns_are_not_hidden_by_their_neighbours():
    points = [point(i, 1.0, reversal=i == 50) for i in range(100)]
    assert "".join(drawn(points)[:-1]).count("▼") == 1


@pytest.mark.parametrize("next_n", [None, 1.0])
def test_before_the_first_answer_there_is_room_for_it(next_n):
    text = "".join(drawn([], next_n)[:-1])
    assert text.count("?") == (next_n is not None)
