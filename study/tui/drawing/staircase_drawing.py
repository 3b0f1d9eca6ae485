"""Draw an adaptive staircase as lines of text: force level (N, logarithmic scale) over the trial number.

Braille dots draw the level, the cap (dashed) and the threshold (dotted); the mark of a trial shows whether the answer
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
MARK_STYLES = {
    RIGHT_MARK: "$text-success",
    WRONG_MARK: "bold $text-error",
    PEAK_MARK: "bold",
    VALLEY_MARK: "bold $text-error",
}
"""Textual style of each mark, with theme variables."""
MUTED_STYLE = "$foreground 65%"
"""Style of labels, legend and summary."""

LABEL_COLUMNS = 8
"""Width for the labels of the level axis in characters, including the space after them."""
MIN_PLOT_COLUMNS, MIN_ROWS = 8, 4
"""Smallest size at which a staircase is drawn: columns beside the labels, and rows. Chosen."""
MIN_AXIS_RATIO = 4.0
"""Smallest ratio of the cap to the lowest level of the axis, so that small changes of the level do not look large.
Chosen."""
AXIS_MARGIN_RATIO = 0.85
"""Largest ratio of the end of the axis to the lowest level, so that the level's mark is not on the edge. Chosen."""
MAX_DOTS_PER_TRIAL = 4.0
"""Largest horizontal distance between trials, in dots, so that short runs of different length are drawn to the same
scale. Chosen."""
_THRESHOLD_DOT_SPACING = 4
"""Distance between the dots of the threshold line, in dots of the canvas. Chosen."""
_MARKS_BY_PRIORITY = (RIGHT_MARK, WRONG_MARK, VALLEY_MARK, PEAK_MARK)
"""Marks by rising priority: of several trials in a character cell, the mark with the highest priority is shown."""


def draw_staircase(staircase: Staircase, columns: int, rows: int) -> tuple[str, ...]:
    """Draw the staircase in `rows` lines for a width of `columns` characters; the last line is the trial axis. A single
    sentence without room or without an answer."""
    if columns < LABEL_COLUMNS + MIN_PLOT_COLUMNS or rows < MIN_ROWS:
        return ("No room to draw.",)
    if not staircase.levels_n:
        return ("Nothing was answered in this run.",)
    canvas = Canvas(columns - LABEL_COLUMNS, rows - 1)
    lowest_n = min(staircase.cap_n / MIN_AXIS_RATIO, AXIS_MARGIN_RATIO * min(staircase.levels_n))
    dots_per_trial = min(MAX_DOTS_PER_TRIAL, (canvas.width - 2) / max(1, len(staircase.levels_n) - 1))

    def compute_y(level_n: float) -> float:
        """Compute y of a level in dots, downwards: 1 at the cap, canvas.height - 2 at the lowest level of the axis."""
        return 1 + (canvas.height - 3) * math.log(staircase.cap_n / level_n) / math.log(staircase.cap_n / lowest_n)

    canvas.draw_line((0, compute_y(staircase.cap_n)), (canvas.width - 1, compute_y(staircase.cap_n)), dashed=True)
    if staircase.threshold_n is not None:
        for x in range(0, canvas.width, _THRESHOLD_DOT_SPACING):
            canvas.set_dot(x, round(compute_y(staircase.threshold_n)))
    dots = [(index * dots_per_trial, compute_y(level)) for index, level in enumerate(staircase.levels_n)]
    for start, end in itertools.pairwise(dots):
        canvas.draw_line(start, (end[0], start[1]))
        canvas.draw_line((end[0], start[1]), end)
    level_labels = {0: staircase.cap_n, canvas.rows - 1: lowest_n}
    if staircase.threshold_n is not None:
        level_labels[round(compute_y(staircase.threshold_n)) // 4] = staircase.threshold_n
    marked_lines = _add_marks(canvas.render_lines(), dots, staircase)
    lines = [
        f"{format_level(level_labels.get(row)):>{LABEL_COLUMNS - 1}} {text}".rstrip()
        for row, text in enumerate(marked_lines)
    ]
    return (*lines, _draw_trial_axis(len(staircase.levels_n), round(dots[-1][0]) // 2, columns))


def summarise_staircase(staircase: Staircase) -> str:
    """Summarise the run in one sentence: trials, right answers, reversals, and the threshold (N) if there is one."""
    reversal_count = sum(staircase.reversals)
    right_count = sum(staircase.correct)
    counts_text = f"{len(staircase.levels_n)} trials, {right_count} right, {reversal_count} reversals"
    if staircase.threshold_n is None:
        return f"{counts_text}."
    return f"{counts_text}; threshold {staircase.threshold_n:.3f} N."


def _add_marks(lines: list[str], dots: list[tuple[float, float]], staircase: Staircase) -> list[str]:
    """Put the mark of each trial into the character cell of its dot (x, y); a cell has 2 x 4 dots. Where trials share a
    cell, `_MARKS_BY_PRIORITY` decides."""
    cells = [list(line) for line in lines]
    marks_by_cell: dict[tuple[int, int], str] = {}
    for index, (x, y) in enumerate(dots):
        mark = choose_mark(staircase.correct[index], staircase.reversals[index])
        cell = (min(max(round(y) // 4, 0), len(cells) - 1), round(x) // 2)
        if cell not in marks_by_cell or _MARKS_BY_PRIORITY.index(mark) >= _MARKS_BY_PRIORITY.index(marks_by_cell[cell]):
            marks_by_cell[cell] = cells[cell[0]][cell[1]] = mark
    return ["".join(row) for row in cells]


def choose_mark(correct: bool, reversal: bool) -> str:
    """Choose the mark of a trial. A reversal at a right answer is a peak, because the level falls from there; at a
    wrong answer it is a valley."""
    if reversal:
        return PEAK_MARK if correct else VALLEY_MARK
    return RIGHT_MARK if correct else WRONG_MARK


def format_level(level_n: float | None) -> str:
    """Format a level with its unit, in as many of three digits as fit into the width of the labels, such as "0.425 N"
    and "0.042 N"; empty for None."""
    if level_n is None:
        return ""
    labels = [f"{level_n:.{digit_count}g} N" for digit_count in (3, 2, 1)]
    return next((label for label in labels if len(label) < LABEL_COLUMNS), labels[-1])


def _draw_trial_axis(trial_count: int, last_column: int, columns: int) -> str:
    """Draw the trial axis: "1" under the first trial, and from two trials on the label of the last, ending at its
    column (from 0) or later. Only "1" where the label does not fit into `columns`."""
    last_label = f"trial {trial_count}" if trial_count > 1 else ""
    gap_columns = max(1, last_column + 1 - len("1") - len(last_label))
    axis = f"{'':{LABEL_COLUMNS}}1{'':{gap_columns}}{last_label}".rstrip()
    return axis if len(axis) <= columns else f"{'':{LABEL_COLUMNS}}1"
