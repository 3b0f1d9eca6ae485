"""A staircase as lines of text: level over trials on a logarithmic scale, in braille dots with marks."""

import itertools
import math

from study.session.views.archive_views import Staircase
from study.tui.drawing.braille import Canvas

RIGHT, WRONG, PEAK, VALLEY = "○", "×", "▼", "▲"
LEGEND = f"{RIGHT} right  {WRONG} wrong  {PEAK} peak  {VALLEY} valley  ┄ cap  ··· threshold"
"""Meaning of the marks, in one line."""

LABEL_COLUMNS = 8
"""Columns of the axis's labels, the space behind them included."""
_LEAST_RANGE = 4.0
"""Smallest ratio of the cap to the lowest drawn level: small movements must not look large."""
_DOTS_PER_TRIAL = 4.0
"""Upper limit, so that short runs stay short and runs can be compared."""
_DOTTED = 4
"""Dots of the canvas from one dot of the threshold's line to the next."""
_FIRST = (RIGHT, WRONG, VALLEY, PEAK)
"""Where several marks share a cell, the last of these is shown."""


def staircase_lines(staircase: Staircase, columns: int, rows: int) -> tuple[str, ...]:
    """Draw the staircase in as many lines as `rows`, at most `columns` wide; the last one counts the trials."""
    if columns < LABEL_COLUMNS + 8 or rows < 4:
        return ("No room to draw.",)
    if not staircase.levels_n:
        return ("Nothing was answered in this run.",)
    canvas = Canvas(columns - LABEL_COLUMNS, rows - 1)
    lowest_n = min(staircase.cap_n / _LEAST_RANGE, 0.85 * min(staircase.levels_n))
    pitch = min(_DOTS_PER_TRIAL, (canvas.width - 2) / max(1, len(staircase.levels_n) - 1))

    def height(level_n: float) -> float:
        return 1 + (canvas.height - 3) * math.log(staircase.cap_n / level_n) / math.log(staircase.cap_n / lowest_n)

    canvas.line((0, height(staircase.cap_n)), (canvas.width - 1, height(staircase.cap_n)), dashed=True)
    if staircase.threshold_n is not None:
        for x in range(0, canvas.width, _DOTTED):
            canvas.dot(x, round(height(staircase.threshold_n)))
    dots = [(place * pitch, height(level)) for place, level in enumerate(staircase.levels_n)]
    for start, end in itertools.pairwise(dots):
        canvas.line(start, (end[0], start[1]))
        canvas.line((end[0], start[1]), end)
    labels = {0: staircase.cap_n, canvas.rows - 1: lowest_n}
    if staircase.threshold_n is not None:
        labels[round(height(staircase.threshold_n)) // 4] = staircase.threshold_n
    drawn = _with_marks(canvas.lines(), dots, staircase)
    lines = [f"{_label(labels.get(row)):>{LABEL_COLUMNS - 1}} {text}".rstrip() for row, text in enumerate(drawn)]
    return (*lines, _trials(len(staircase.levels_n), round(dots[-1][0]) // 2))


def summary(staircase: Staircase) -> str:
    """The run in a sentence."""
    turns = sum(staircase.reversals)
    right = sum(staircase.correct)
    counted = f"{len(staircase.levels_n)} trials, {right} right, {turns} reversals"
    if staircase.threshold_n is None:
        return f"{counted}."
    return f"{counted}; threshold {staircase.threshold_n:.3f} N."


def _with_marks(lines: list[str], dots: list[tuple[float, float]], staircase: Staircase) -> list[str]:
    cells = [list(line) for line in lines]
    shown: dict[tuple[int, int], str] = {}
    for place, (x, y) in enumerate(dots):
        mark = _mark(staircase.correct[place], staircase.reversals[place])
        cell = (min(max(round(y) // 4, 0), len(cells) - 1), round(x) // 2)
        if cell not in shown or _FIRST.index(mark) >= _FIRST.index(shown[cell]):
            shown[cell] = cells[cell[0]][cell[1]] = mark
    return ["".join(row) for row in cells]


def _mark(correct: bool, reversal: bool) -> str:
    """A reversal after a right answer is a peak, after a wrong one a valley."""
    if reversal:
        return PEAK if correct else VALLEY
    return RIGHT if correct else WRONG


def _label(level_n: float | None) -> str:
    return "" if level_n is None else f"{level_n:.3g} N"


def _trials(trials: int, last_column: int) -> str:
    end = f"trial {trials}" if trials > 1 else ""
    gap = max(1, last_column + 1 - len("1") - len(end))
    return f"{'':{LABEL_COLUMNS}}1{'':{gap}}{end}".rstrip()
