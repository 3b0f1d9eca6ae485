"""Raster graphics in a UTF-8 terminal: a canvas of braille characters (from U+2800), each with 2 x 4 dots.

Lines are sampled at each dot; filled shapes are convex polygons, drawn row by row (scan lines). The grid of dots is
nearly square, because a character cell is about twice as high as wide. Coordinates are in dots.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field

_DOT_BITS = ((0x01, 0x08), (0x02, 0x10), (0x04, 0x20), (0x40, 0x80))
"""Bit of the dot in row r and column c of a cell, as `_DOT_BITS[r][c]`: the offset of its character from U+2800."""

Point = tuple[float, float]
"""x (to the right) and y (downwards) in dots, from the centre of the upper left dot."""


@dataclass(slots=True)
class Canvas:
    """A raster of dots that are set or not, of `columns` x `rows` character cells; empty at first. x points to the
    right and y downwards."""

    columns: int
    rows: int
    _cells: list[int] = field(init=False)
    """Bits of the dots of each cell, row by row."""

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
    def centre(self) -> Point:
        """Centre of the canvas; it lies between dots."""
        return (self.width - 1) / 2, (self.height - 1) / 2

    def set_dot(self, x: int, y: int) -> None:
        """Set a dot; dots outside the canvas are ignored."""
        if 0 <= x < self.width and 0 <= y < self.height:
            self._cells[(y // 4) * self.columns + x // 2] |= _DOT_BITS[y % 4][x % 2]

    def draw_line(self, start: Point, end: Point, dashed: bool = False) -> None:
        """Draw a straight line one dot wide, both ends included. dashed: set only five of every eight dots,
        chosen."""
        step_count = max(1, round(max(abs(end[0] - start[0]), abs(end[1] - start[1]))))
        for step in range(step_count + 1):
            if dashed and step % 8 >= 5:
                continue
            fraction = step / step_count
            x, y = start[0] + fraction * (end[0] - start[0]), start[1] + fraction * (end[1] - start[1])
            self.set_dot(round(x), round(y))

    def draw_bar(self, start: Point, end: Point, thickness: float) -> None:
        """Draw a filled straight bar with square ends; nothing if its length is 0. thickness: in dots."""
        length = math.dist(start, end)
        if length == 0:
            return
        half_width = (start[1] - end[1]) / length * thickness / 2, (end[0] - start[0]) / length * thickness / 2
        self.fill_polygon(
            (
                (start[0] + half_width[0], start[1] + half_width[1]),
                (end[0] + half_width[0], end[1] + half_width[1]),
                (end[0] - half_width[0], end[1] - half_width[1]),
                (start[0] - half_width[0], start[1] - half_width[1]),
            )
        )

    def draw_circle(self, centre: Point, radius: float) -> None:
        """Draw the outline of a circle, one dot wide. radius: in dots, as in `draw_disc`."""
        step_count = max(8, math.ceil(2 * math.pi * radius))
        for step in range(step_count):
            angle = 2 * math.pi * step / step_count
            self.set_dot(round(centre[0] + radius * math.cos(angle)), round(centre[1] + radius * math.sin(angle)))

    def draw_disc(self, centre: Point, radius: float) -> None:
        """Draw a filled circle, approximated by a regular polygon with 24 corners, chosen."""
        angles = [2 * math.pi * corner_index / 24 for corner_index in range(24)]
        self.fill_polygon(
            [(centre[0] + radius * math.cos(angle), centre[1] + radius * math.sin(angle)) for angle in angles]
        )

    def fill_polygon(self, corners: Sequence[Point]) -> None:
        """Fill a convex polygon, outline included, row by row between the outermost crossings with its edges."""
        top = max(0, math.ceil(min(y for _, y in corners)))
        bottom = min(self.height - 1, math.floor(max(y for _, y in corners)))
        edges = list(zip(corners, [*corners[1:], corners[0]], strict=True))
        for y in range(top, bottom + 1):
            crossings = [
                _compute_edge_crossing_x(edge_start, edge_end, y)
                for edge_start, edge_end in edges
                if min(edge_start[1], edge_end[1]) <= y <= max(edge_start[1], edge_end[1])
            ]
            for x in range(math.ceil(min(crossings)), math.floor(max(crossings)) + 1):
                self.set_dot(x, y)

    def render_lines(self) -> list[str]:
        """Render the canvas as text: `rows` lines of `columns` characters; cells without a dot are spaces."""
        lines = [
            "".join(chr(0x2800 + dot_bits) for dot_bits in self._select_row_cells(row_index))
            for row_index in range(self.rows)
        ]
        return [line.replace("\u2800", " ") for line in lines]

    def _select_row_cells(self, row: int) -> list[int]:
        """Select the cells of a row of characters, counted from 0."""
        return self._cells[row * self.columns : (row + 1) * self.columns]


def _compute_edge_crossing_x(edge_start: Point, edge_end: Point, y: float) -> float:
    """Compute x at which an edge crosses the row y; for a horizontal edge, x of its start."""
    return (
        edge_start[0]
        if edge_start[1] == edge_end[1]
        else edge_start[0] + (y - edge_start[1]) / (edge_end[1] - edge_start[1]) * (edge_end[0] - edge_start[0])
    )
