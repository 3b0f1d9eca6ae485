"""Plot of the staircase of the current run: level (N, logarithmic) over trials, drawn in braille dots.

For the experimenter's view only: levels and correctness must not be shown to the participant.
"""

import itertools
import math
from collections.abc import Sequence

from textual.content import Content
from textual.widget import Widget

from study.session.watching.watch_view import StaircasePoint
from study.tui.drawing.braille import Canvas
from study.tui.drawing.staircase_drawing import LABEL_COLUMNS, PEAK_MARK, RIGHT_MARK, VALLEY_MARK, WRONG_MARK

LEAST_RANGE = 4.0
"""Smallest ratio of the cap to the lowest level of the axis, so that small steps do not look large."""
DOTS_PER_TRIAL = 4.0
"""Largest horizontal distance of two trials, in braille dots; with many trials it is smaller."""

MUTED = "$foreground 65%"
"""Style of labels and legend."""
NEXT_MARK = "?"
"""Mark of the next level."""
LEGEND = f"{RIGHT_MARK} right {WRONG_MARK} wrong {PEAK_MARK}{VALLEY_MARK} reversal {NEXT_MARK}next ┄cap"
"""Meaning of the marks, on a single line."""

_STYLES = {
    RIGHT_MARK: "$text-success",
    WRONG_MARK: "bold $text-error",
    PEAK_MARK: "bold",
    VALLEY_MARK: "bold $text-error",
    NEXT_MARK: "bold",
}
"""Style of each mark."""
_FIRST = {WRONG_MARK: 1, RIGHT_MARK: 0, PEAK_MARK: 2, VALLEY_MARK: 2, NEXT_MARK: 3}
"""Priority of the marks: where several fall into the same cell, that with the highest number is drawn."""


class LevelHistory(Widget):
    """Draws a staircase in the whole area of the widget: level over trials, answers and reversals as marks, the next
    level, the cap as a dashed line."""

    def __init__(self, *, id: str | None = None) -> None:
        super().__init__(id=id)
        self._points: tuple[StaircasePoint, ...] = ()
        self._next_n: float | None = None
        self._cap_n = 1.0

    def show(self, points: tuple[StaircasePoint, ...], next_n: float | None, cap_n: float) -> None:
        """Show a staircase; redraws only if something changed. next_n: level of the next trial (N), None where it is
        not known; cap_n: largest level (N)."""
        if (points, next_n, cap_n) != (self._points, self._next_n, self._cap_n):
            self._points, self._next_n, self._cap_n = points, next_n, cap_n
            self.refresh()

    def render(self) -> Content:
        width, height = self.content_size.width, self.content_size.height
        if width < LABEL_COLUMNS + 8 or height < 4:
            return Content("No room for the staircase.")
        return level_history(self._points, self._next_n, self._cap_n, (width, height))


def level_history(
    points: Sequence[StaircasePoint], next_n: float | None, cap_n: float, size: tuple[int, int]
) -> Content:
    """The staircase with marks, labels of levels (N) and legend, as text. size: columns and rows in character cells,
    labels and legend included."""
    columns, rows = size[0] - LABEL_COLUMNS, size[1] - 1
    levels = [point.level_n for point in points] + ([next_n] if next_n is not None else [])
    lowest_n = min([cap_n / LEAST_RANGE, *(0.85 * level for level in levels)])
    canvas = Canvas(columns, rows)
    pitch = min(DOTS_PER_TRIAL, (canvas.width - 2) / max(1, len(levels) - 1))

    def dot(place: int, level_n: float) -> tuple[float, float]:
        """Position of a level in dots: the cap is at the top, the lowest level at the bottom."""
        share = math.log(cap_n / level_n) / math.log(cap_n / lowest_n)
        return place * pitch, 1 + share * (canvas.height - 3)

    canvas.line(dot(0, cap_n), (canvas.width - 1, dot(0, cap_n)[1]), dashed=True)
    dots = [dot(place, level) for place, level in enumerate(levels)]
    for start, end in itertools.pairwise(dots):
        canvas.line(start, end)
    marks: dict[tuple[int, int], str] = {}
    for (x, y), mark in zip(dots, [*map(_point_mark, points), NEXT_MARK], strict=False):
        cell = (round(y) // 4, round(x) // 2)
        if cell not in marks or _FIRST[mark] >= _FIRST[marks[cell]]:
            marks[cell] = mark
    labels = {0: cap_n, rows - 1: lowest_n}
    if levels:
        labels[round(dots[-1][1]) // 4] = levels[-1]
    lines = [_line(row, text, marks, labels.get(row)) for row, text in enumerate(canvas.lines())]
    legend = Content.styled(f"{'':{LABEL_COLUMNS}}{LEGEND}"[: size[0]], MUTED)
    return Content("\n").join([*lines, legend])


def _point_mark(point: StaircasePoint) -> str:
    """Mark of a trial. A reversal after a right answer is a peak of the staircase, after a wrong answer a valley."""
    if point.reversal:
        return PEAK_MARK if point.correct else VALLEY_MARK
    return RIGHT_MARK if point.correct else WRONG_MARK


def _line(row: int, text: str, marks: dict[tuple[int, int], str], label_n: float | None) -> Content:
    label = f"{label_n:5.3g} N" if label_n is not None else ""
    parts: list[Content | str | tuple[str, str]] = [(f"{label:>{LABEL_COLUMNS - 1}} ", MUTED)]
    for column, dots in enumerate(text):
        mark = marks.get((row, column))
        parts.append(dots if mark is None else (mark, _STYLES[mark]))
    return Content.assemble(*parts)
