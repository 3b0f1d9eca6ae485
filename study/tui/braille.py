"""A canvas of braille dots: 2 x 4 per character cell, nearly square, in any UTF-8 terminal."""

from dataclasses import dataclass, field

_DOTS = ((0x01, 0x08), (0x02, 0x10), (0x04, 0x20), (0x40, 0x80))
"""Bit of the dot in row r, column c of a cell, in Unicode's order."""


@dataclass(slots=True)
class Canvas:
    """Dots with x to the right and y downwards, from the upper left corner."""

    columns: int
    rows: int
    _cells: list[int] = field(init=False)

    def __post_init__(self) -> None:
        self._cells = [0] * (self.columns * self.rows)

    @property
    def width(self) -> int:
        return 2 * self.columns

    @property
    def height(self) -> int:
        return 4 * self.rows

    def dot(self, x: int, y: int) -> None:
        """Dots outside the canvas are dropped."""
        if 0 <= x < self.width and 0 <= y < self.height:
            self._cells[(y // 4) * self.columns + x // 2] |= _DOTS[y % 4][x % 2]

    def line(self, start: tuple[float, float], end: tuple[float, float], dashed: bool = False) -> None:
        steps = max(1, round(max(abs(end[0] - start[0]), abs(end[1] - start[1]))))
        for i in range(steps + 1):
            if dashed and i % 8 >= 5:
                continue
            share = i / steps
            x, y = start[0] + share * (end[0] - start[0]), start[1] + share * (end[1] - start[1])
            self.dot(round(x), round(y))

    def lines(self) -> list[str]:
        cells = ["".join(chr(0x2800 + c) for c in self._row(r)) for r in range(self.rows)]
        return [row.replace("\u2800", " ") for row in cells]

    def _row(self, row: int) -> list[int]:
        return self._cells[row * self.columns : (row + 1) * self.columns]
