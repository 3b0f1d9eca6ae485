"""Plot of the adaptive staircase of the current run: level (N, logarithmic) over trials, drawn in braille dots.

For the experimenter's view only: levels and correctness must not be shown to the participant.
"""

import itertools
import math
from collections.abc import Sequence

from textual.content import Content
from textual.widget import Widget

from study.session.watching.watch_view import StaircasePoint
from study.tui.drawing.braille import Canvas
from study.tui.drawing.staircase_drawing import (
    AXIS_MARGIN_RATIO,
    LABEL_COLUMNS,
    MARK_STYLES,
    MAX_DOTS_PER_TRIAL,
    MIN_AXIS_RATIO,
    MIN_PLOT_COLUMNS,
    MIN_ROWS,
    MUTED_STYLE,
    PEAK_MARK,
    RIGHT_MARK,
    VALLEY_MARK,
    WRONG_MARK,
    choose_mark,
    format_level,
)

NEXT_MARK = "?"
LEGEND = f"{RIGHT_MARK} right {WRONG_MARK} wrong {PEAK_MARK}{VALLEY_MARK} reversal {NEXT_MARK}next ┄cap"
"""Meaning of the marks, on a single line."""

_MARK_STYLES = {**MARK_STYLES, NEXT_MARK: "bold"}
_MARK_PRIORITY = {WRONG_MARK: 1, RIGHT_MARK: 0, PEAK_MARK: 2, VALLEY_MARK: 2, NEXT_MARK: 3}
"""Priority of each mark: if several marks share a character cell, that with the highest number is drawn."""


class LevelHistory(Widget):
    """Widget with the plot of a staircase: level over trials, answers and reversals as marks, the next level, the cap
    as a dashed line."""

    def __init__(self, *, id: str | None = None) -> None:
        super().__init__(id=id)
        self._points: tuple[StaircasePoint, ...] = ()
        self._next_level_n: float | None = None
        self._cap_n = 1.0

    def show(self, points: tuple[StaircasePoint, ...], next_n: float | None, cap_n: float) -> None:
        """Show a staircase; redraws only if something changed. points: trials so far; next_n: level of the next trial
        (N), None if unknown; cap_n: largest allowed level (N)."""
        if (points, next_n, cap_n) != (self._points, self._next_level_n, self._cap_n):
            self._points, self._next_level_n, self._cap_n = points, next_n, cap_n
            self.refresh()

    def render(self) -> Content:
        width, height = self.content_size.width, self.content_size.height
        if width < LABEL_COLUMNS + MIN_PLOT_COLUMNS or height < MIN_ROWS:
            return Content("No room for the staircase.")
        return draw_level_history(self._points, self._next_level_n, self._cap_n, (width, height))


def draw_level_history(
    points: Sequence[StaircasePoint], next_n: float | None, cap_n: float, size: tuple[int, int]
) -> Content:
    """Draw the staircase as text, with marks, labels of levels (N) and legend. points, next_n, cap_n: as in
    `LevelHistory.show`. size: columns and rows in character cells, labels and legend included."""
    columns, rows = size[0] - LABEL_COLUMNS, size[1] - 1
    levels_n = [point.level_n for point in points] + ([next_n] if next_n is not None else [])
    lowest_n = min([cap_n / MIN_AXIS_RATIO, *(AXIS_MARGIN_RATIO * trial_level_n for trial_level_n in levels_n)])
    canvas = Canvas(columns, rows)
    dots_per_trial = min(MAX_DOTS_PER_TRIAL, (canvas.width - 2) / max(1, len(levels_n) - 1))

    def locate_level(trial_index: int, level_n: float) -> tuple[float, float]:
        """Compute the position (x, y) of a trial in dots: y is 1 at the cap, and canvas.height - 2 at the lower end of
        the axis."""
        depth = math.log(cap_n / level_n) / math.log(cap_n / lowest_n)
        return trial_index * dots_per_trial, 1 + depth * (canvas.height - 3)

    canvas.draw_line(locate_level(0, cap_n), (canvas.width - 1, locate_level(0, cap_n)[1]), dashed=True)
    points_in_dots = [locate_level(trial_index, trial_level_n) for trial_index, trial_level_n in enumerate(levels_n)]
    for start, end in itertools.pairwise(points_in_dots):
        canvas.draw_line(start, end)
    marks_by_cell: dict[tuple[int, int], str] = {}
    for (x, y), mark in zip(
        points_in_dots, [*(choose_mark(point.correct, point.reversal) for point in points), NEXT_MARK], strict=False
    ):
        cell = (round(y) // 4, round(x) // 2)  # a cell has 2 x 4 dots
        if cell not in marks_by_cell or _MARK_PRIORITY[mark] >= _MARK_PRIORITY[marks_by_cell[cell]]:
            marks_by_cell[cell] = mark
    level_labels = {0: cap_n, rows - 1: lowest_n}
    if levels_n:
        level_labels[round(points_in_dots[-1][1]) // 4] = levels_n[-1]
    lines = [
        _style_row(row, text, marks_by_cell, level_labels.get(row)) for row, text in enumerate(canvas.render_lines())
    ]
    legend = Content.styled(f"{'':{LABEL_COLUMNS}}{LEGEND}"[: size[0]], MUTED_STYLE)
    return Content("\n").join([*lines, legend])


def _style_row(row: int, text: str, marks: dict[tuple[int, int], str], label_n: float | None) -> Content:
    """Convert a row of characters to styled text, with its level label (N; none for None) before it and marks in place
    of their cells."""
    parts: list[Content | str | tuple[str, str]] = [(f"{format_level(label_n):>{LABEL_COLUMNS - 1}} ", MUTED_STYLE)]
    for column, character in enumerate(text):
        mark = marks.get((row, column))
        parts.append(character if mark is None else (mark, _MARK_STYLES[mark]))
    return Content.assemble(*parts)
