"""Draw a large digit 1 or 2 with braille characters, for trials whose answer is an interval instead of a direction."""

from functools import lru_cache
from itertools import pairwise

from study.tui.drawing.braille import Canvas, Point

_STROKES: dict[int, tuple[Point, ...]] = {
    1: ((-0.28, 0.62), (0.05, 1.0), (0.05, -1.0), (-0.32, -1.0), (0.42, -1.0)),
    2: ((-0.5, 0.5), (-0.38, 0.85), (0.0, 1.0), (0.38, 0.85), (0.5, 0.5), (0.38, 0.1), (-0.5, -1.0), (0.52, -1.0)),
}
"""Corners of the polyline of each digit: (right, up) from its centre, in units of half its height. Drawn by hand."""


@lru_cache(maxsize=16)  # a few sizes of the panel
def draw_large_digit(digit: int, columns: int, rows: int) -> tuple[str, ...]:
    """Draw the digit 1 or 2 as `rows` lines of `columns` braille characters, scaled to the smaller side of the canvas.
    Raises KeyError for another digit."""
    canvas = Canvas(columns, rows)
    centre_x, centre_y = canvas.centre
    # In dots: a tenth of the height, but wide enough that a small digit has no gaps.
    stroke_width = max(2.5, centre_y / 5)
    half_height = min(centre_x, centre_y) - stroke_width / 2
    corners = [
        (centre_x + half_height * corner_right, centre_y - half_height * corner_up)
        for corner_right, corner_up in _STROKES[digit]
    ]
    for start, end in pairwise(corners):
        canvas.draw_bar(start, end, stroke_width)
    for corner in corners:
        canvas.draw_disc(corner, stroke_width / 2)
    return tuple(canvas.render_lines())
