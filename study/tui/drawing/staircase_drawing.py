"""Draw an adaptive staircase as lines of text: force level (N, logarithmic scale) over the number of the trial.

Braille dots draw the level, the cap (dashed) and the threshold (dotted); a mark at each trial shows whether the answer
was right, and whether the staircase reversed there.
"""

import itertools
import math

from study.session.views.archive_views import Staircase
from study.tui.drawing.braille import Canvas

RIGHT_MARK, WRONG_MARK, PEAK_MARK, VALLEY_MARK = "○", "×", "▼", "▲"
"""Marks of a right and a wrong answer, and of an upper and a lower reversal."""
LEGEND = f"{RIGHT_MARK} right  {WRONG_MARK} wrong  {PEAK_MARK} peak  {VALLEY_MARK} valley  ┄ cap  ··· threshold"
"""Meaning of the marks, in one line."""

LABEL_COLUMNS = 8
"""Width of the labels of the level axis in characters, including the space after them."""
_LEAST_RANGE = 4.0
"""Smallest ratio of the cap to the lowest level of the axis, so that small changes of the level do not look large."""
_DOTS_PER_TRIAL = 4.0
"""Largest horizontal distance between trials, in dots, so that runs of different length are drawn to the same scale
where they fit."""
_DOTTED = 4
"""Distance between the dots of the threshold line, in dots of the canvas."""
_FIRST = (RIGHT_MARK, WRONG_MARK, VALLEY_MARK, PEAK_MARK)
"""Marks by rising priority: of several trials in a character cell, the mark with the highest priority is shown."""


def staircase_lines(staircase: Staircase, columns: int, rows: int) -> tuple[str, ...]:
    """Draw the staircase in `rows` lines of at most `columns` characters; the last line is the axis of trials. A single
    sentence if there is too little room or no answer."""
    if columns < LABEL_COLUMNS + 8 or rows < 4:
        return ("No room to draw.",)
    if not staircase.levels_n:
        return ("Nothing was answered in this run.",)
    canvas = Canvas(columns - LABEL_COLUMNS, rows - 1)
    lowest_n = min(staircase.cap_n / _LEAST_RANGE, 0.85 * min(staircase.levels_n))
    pitch = min(_DOTS_PER_TRIAL, (canvas.width - 2) / max(1, len(staircase.levels_n) - 1))

    def height(level_n: float) -> float:
        """y in dots of a level: 1 at the cap, two less than the height of the canvas at the lowest level."""
        return 1 + (canvas.height - 3) * math.log(staircase.cap_n / level_n) / math.log(staircase.cap_n / lowest_n)

    canvas.line((0, height(staircase.cap_n)), (canvas.width - 1, height(staircase.cap_n)), dashed=True)
    if staircase.threshold_n is not None:
        for x in range(0, canvas.width, _DOTTED):
            canvas.dot(x, round(height(staircase.threshold_n)))
    dots = [(index * pitch, height(level)) for index, level in enumerate(staircase.levels_n)]
    for start, end in itertools.pairwise(dots):
        canvas.line(start, (end[0], start[1]))
        canvas.line((end[0], start[1]), end)
    labels = {0: staircase.cap_n, canvas.rows - 1: lowest_n}
    if staircase.threshold_n is not None:
        labels[round(height(staircase.threshold_n)) // 4] = staircase.threshold_n
    marked_lines = _with_marks(canvas.lines(), dots, staircase)
    lines = [f"{_label(labels.get(row)):>{LABEL_COLUMNS - 1}} {text}".rstrip() for row, text in enumerate(marked_lines)]
    return (*lines, _trials(len(staircase.levels_n), round(dots[-1][0]) // 2))


def summary(staircase: Staircase) -> str:
    """The run in one sentence: trials, right answers, reversals, and the threshold (N) if there is one."""
    turns = sum(staircase.reversals)
    right_answers = sum(staircase.correct)
    counts_text = f"{len(staircase.levels_n)} trials, {right_answers} right, {turns} reversals"
    if staircase.threshold_n is None:
        return f"{counts_text}."
    return f"{counts_text}; threshold {staircase.threshold_n:.3f} N."


def _with_marks(lines: list[str], dots: list[tuple[float, float]], staircase: Staircase) -> list[str]:
    """The lines with the mark of each trial in the character cell of its dot (x, y)."""
    cells = [list(line) for line in lines]
    marks_by_cell: dict[tuple[int, int], str] = {}
    for index, (x, y) in enumerate(dots):
        mark = _mark(staircase.correct[index], staircase.reversals[index])
        cell = (min(max(round(y) // 4, 0), len(cells) - 1), round(x) // 2)
        if cell not in marks_by_cell or _FIRST.index(mark) >= _FIRST.index(marks_by_cell[cell]):
            marks_by_cell[cell] = cells[cell[0]][cell[1]] = mark
    return ["".join(row) for row in cells]


def _mark(correct: bool, reversal: bool) -> str:
    """Mark of a trial. A reversal at a right answer is a peak, because the level falls from there; at a wrong answer it
    is a valley."""
    if reversal:
        return PEAK_MARK if correct else VALLEY_MARK
    return RIGHT_MARK if correct else WRONG_MARK


def _label(level_n: float | None) -> str:
    """A level with its unit; empty for None."""
    return "" if level_n is None else f"{level_n:.3g} N"


def _trials(trials: int, last_column: int) -> str:
    """The axis of trials: 1 under the first trial, and the number of the last, ending at its column."""
    end = f"trial {trials}" if trials > 1 else ""
    gap = max(1, last_column + 1 - len("1") - len(end))
    return f"{'':{LABEL_COLUMNS}}1{'':{gap}}{end}".rstrip()
