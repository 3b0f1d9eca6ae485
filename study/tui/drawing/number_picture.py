"""Draw a large digit 1 or 2 with braille characters, for trials whose answer is an interval instead of a direction."""

from functools import lru_cache
from itertools import pairwise

from study.tui.drawing.braille import Canvas, Point

_STROKES: dict[int, tuple[Point, ...]] = {
    1: ((-0.28, 0.62), (0.05, 1.0), (0.05, -1.0), (-0.32, -1.0), (0.42, -1.0)),
    2: ((-0.5, 0.5), (-0.38, 0.85), (0.0, 1.0), (0.38, 0.85), (0.5, 0.5), (0.38, 0.1), (-0.5, -1.0), (0.52, -1.0)),
}
"""Corners of the polyline of each digit: (right, up) from its centre, in units of half its height."""


@lru_cache(maxsize=16)
def large_number(number: int, columns: int, rows: int) -> tuple[str, ...]:
    """The digit 1 or 2 as `rows` lines of `columns` braille characters, scaled to the smaller side. Raises KeyError for
    another number."""
    canvas = Canvas(columns, rows)
    x, y = canvas.centre
    thick = max(2.5, y / 5)
    reach = min(x, y) - thick / 2
    corners = [(x + reach * corner_right, y - reach * corner_up) for corner_right, corner_up in _STROKES[number]]
    for start, end in pairwise(corners):
        canvas.draw_bar(start, end, thick)
    for corner in corners:
        canvas.draw_disc(corner, thick / 2)
    return tuple(canvas.render_lines())
