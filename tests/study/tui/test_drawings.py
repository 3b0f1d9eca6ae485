"""Large drawings for the screens."""

import math

import pytest

from study.session.views.participant_views import DirectionPicture
from study.tui.drawing.braille import Canvas
from study.tui.drawing.direction_picture import draw_large_direction
from study.tui.drawing.number_picture import draw_large_digit

DIAGONAL = DirectionPicture("yz", (135.0, 45.0))


def dots(lines):
    """(x, y) of every dot."""
    bits = ((0x01, 0x08), (0x02, 0x10), (0x04, 0x20), (0x40, 0x80))
    return {
        (2 * column + c, 4 * row + r)
        for row, line in enumerate(lines)
        for column, cell in enumerate(line)
        if cell != " "
        for r in range(4)
        for c in range(2)
        if (ord(cell) - 0x2800) & bits[r][c]
    }


def test_a_stroke_is_as_thick_as_it_says():
    canvas = Canvas(10, 5)
    canvas.draw_bar((2, 10), (17, 10), 4.0)
    assert dots(canvas.render_lines()) == {(x, y) for x in range(2, 18) for y in range(8, 13)}


def test_a_stroke_of_no_length_draws_nothing():
    canvas = Canvas(4, 2)
    canvas.draw_bar((3, 3), (3, 3), 4.0)
    assert not dots(canvas.render_lines())


def test_what_is_filled_outside_the_canvas_is_dropped():
    canvas = Canvas(4, 2)
    canvas.fill_polygon(((-50, -50), (50, -50), (50, 50), (-50, 50)))
    assert len(dots(canvas.render_lines())) == 8 * 8


def test_a_disc_is_round():
    canvas = Canvas(20, 10)
    canvas.draw_disc(canvas.centre, 12.0)
    drawn = dots(canvas.render_lines())
    assert all(math.dist(dot, canvas.centre) <= 12.01 for dot in drawn)
    assert len(drawn) == pytest.approx(math.pi * 144, rel=0.05)


def test_a_circle_is_only_its_line():
    canvas = Canvas(20, 10)
    canvas.draw_circle(canvas.centre, 12.0)
    assert all(11.0 <= math.dist(dot, canvas.centre) <= 13.0 for dot in dots(canvas.render_lines()))


@pytest.mark.parametrize("angle", [0.0, 20.0, 45.0, 70.0, 90.0, 135.0, 170.0])
def test_a_segment_lies_along_its_direction_and_is_symmetric(angle):
    picture = DirectionPicture("yz", (angle, angle + 90.0))
    drawn = dots(draw_large_direction(picture, 1, 40, 20))
    x = [dot[0] - 39.5 for dot in drawn]
    y = [39.5 - dot[1] for dot in drawn]
    assert abs(sum(x)) < 0.2 * len(x) and abs(sum(y)) < 0.2 * len(y)
    xy = sum(a * b for a, b in zip(x, y, strict=True))
    xx, yy = sum(a * a for a in x), sum(b * b for b in y)
    axis = math.degrees(0.5 * math.atan2(2 * xy, xx - yy))
    assert abs((axis - angle + 90) % 180 - 90) < 2.0


def test_both_segments_are_equally_long_and_only_one_is_broken():
    length = {}
    for number in (1, 2):
        drawn = dots(draw_large_direction(DIAGONAL, number, 40, 20))
        length[number] = max(math.dist(a, b) for a in drawn for b in drawn)
    assert length[1] == pytest.approx(length[2], rel=0.03)
    solid, dashed = (len(dots(draw_large_direction(DIAGONAL, number, 40, 20))) for number in (1, 2))
    assert dashed < 0.85 * solid


@pytest.mark.parametrize(("columns", "rows"), [(2, 1), (6, 3), (20, 10), (92, 46)])
def test_drawings_fit_any_room(columns, rows):
    for drawn in (draw_large_direction(DIAGONAL, 2, columns, rows), draw_large_digit(2, columns, rows)):
        assert len(drawn) == rows and all(len(line) == columns for line in drawn)


def test_large_numbers_are_two_different_ones():
    assert draw_large_digit(1, 30, 15) != draw_large_digit(2, 30, 15)
    assert dots(draw_large_digit(1, 30, 15)) and dots(draw_large_digit(2, 30, 15))
