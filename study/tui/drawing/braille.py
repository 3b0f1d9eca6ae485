"""Raster graphics in a UTF-8 terminal: a canvas of braille characters (from U+2800), each with 2 x 4 dots.

Lines are sampled at each dot, filled shapes are convex polygons drawn row by row (scan lines). The dots are nearly
square, because a character cell is about twice as high as wide. Coordinates are in dots.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field

_DOTS = ((0x01, 0x08), (0x02, 0x10), (0x04, 0x20), (0x40, 0x80))
"""Bit of the dot in row r and column c of a cell, as `_DOTS[r][c]`: the offset of its character from U+2800."""

Point = tuple[float, float]
"""x (to the right) and y (downwards) in dots, from the centre of the upper left dot."""


@dataclass(slots=True)
class Canvas:
    """A raster of dots that are set or not, of `columns` x `rows` character cells; empty at first. x points to the
    right and y downwards."""

    columns: int
    rows: int
    _cells: list[int] = field(init=False)

    def __post_init__(self) -> None:
        self._cells = [0] * (self.columns * self.rows)

    @property
    def width(self) -> int:
        """Number of dots in a row."""
        return 2 * self.columns

    @property
    def height(self) -> int:
        """Number of rows of dots."""
        return 4 * self.rows

    @property
    def middle(self) -> Point:
        """Centre of the canvas; it lies between dots."""
        return (self.width - 1) / 2, (self.height - 1) / 2

    def dot(self, x: int, y: int) -> None:
        """Set a dot; outside the canvas, nothing happens."""
        if 0 <= x < self.width and 0 <= y < self.height:
            self._cells[(y // 4) * self.columns + x // 2] |= _DOTS[y % 4][x % 2]

    def line(self, start: Point, end: Point, dashed: bool = False) -> None:
        """Draw a line of the width of one dot, both ends included. dashed: set only five of every eight dots."""
        steps = max(1, round(max(abs(end[0] - start[0]), abs(end[1] - start[1]))))
        for i in range(steps + 1):
            if dashed and i % 8 >= 5:
                continue
            share = i / steps
            x, y = start[0] + share * (end[0] - start[0]), start[1] + share * (end[1] - start[1])
            self.dot(round(x), round(y))

    def stroke(self, start: Point, end: Point, thickness: float) -> None:
        """Draw a straight bar of this thickness with square ends; nothing if its length is 0."""
        length = math.dist(start, end)
        if length == 0:
            return
        offset = (start[1] - end[1]) / length * thickness / 2, (end[0] - start[0]) / length * thickness / 2
        self.fill(
            (
                (start[0] + offset[0], start[1] + offset[1]),
                (end[0] + offset[0], end[1] + offset[1]),
                (end[0] - offset[0], end[1] - offset[1]),
                (start[0] - offset[0], start[1] - offset[1]),
            )
        )

    def circle(self, centre: Point, radius: float) -> None:
        """Draw the outline of a circle, one dot wide."""
        steps = max(8, math.ceil(2 * math.pi * radius))
        for i in range(steps):
            turn = 2 * math.pi * i / steps
            self.dot(round(centre[0] + radius * math.cos(turn)), round(centre[1] + radius * math.sin(turn)))

    def disc(self, centre: Point, radius: float) -> None:
        """Draw a filled circle, approximated by a polygon of 24 corners."""
        turns = [2 * math.pi * i / 24 for i in range(24)]
        self.fill([(centre[0] + radius * math.cos(turn), centre[1] + radius * math.sin(turn)) for turn in turns])

    def fill(self, corners: Sequence[Point]) -> None:
        """Fill a convex polygon, outline included, row by row between the outermost crossings with its edges."""
        top = max(0, math.ceil(min(y for _, y in corners)))
        bottom = min(self.height - 1, math.floor(max(y for _, y in corners)))
        sides = list(zip(corners, [*corners[1:], corners[0]], strict=True))
        for y in range(top, bottom + 1):
            crossings = [_edge_crossing_x(a, b, y) for a, b in sides if min(a[1], b[1]) <= y <= max(a[1], b[1])]
            for x in range(math.ceil(min(crossings)), math.floor(max(crossings)) + 1):
                self.dot(x, y)

    def lines(self) -> list[str]:
        """The canvas as lines of `columns` characters, `rows` of them; cells without a dot are blanks."""
        cells = ["".join(chr(0x2800 + c) for c in self._row(r)) for r in range(self.rows)]
        return [row.replace("\u2800", " ") for row in cells]

    def _row(self, row: int) -> list[int]:
        return self._cells[row * self.columns : (row + 1) * self.columns]


def _edge_crossing_x(a: Point, b: Point, y: float) -> float:
    """x at which the edge from a to b crosses the row y; for a horizontal edge, x of its start."""
    return a[0] if a[1] == b[1] else a[0] + (y - a[1]) / (b[1] - a[1]) * (b[0] - a[0])
