"""Panel for one of the two answers of a trial: its number, its direction as a thick line, and its description in words.

Number, words and the heavier frame carry the same information as the colour, so that colour is not needed.
"""

import textwrap
from typing import Literal

from rich.segment import Segment
from rich.style import Style
from textual.geometry import Size
from textual.reactive import reactive
from textual.strip import Strip
from textual.widget import Widget

from protocols.wording.words import ENGLISH_WORDS, Words
from study.session.views.participant_views import DirectionPicture
from study.tui.drawing.direction_picture import describe_direction, draw_large_direction
from study.tui.drawing.number_picture import draw_large_digit

LARGE_DIGITS = {1: ("╺┓ ", " ┃ ", "╺┻╸"), 2: ("┏━┓", "┏━┛", "┗━╸")}
"""Large digit of each answer, by its number: three lines of three columns."""
DIGIT_MARGIN_COLUMNS = 5
"""Columns kept free for the number left of the drawing, and as many on its right: a digit of 3 columns with a blank on
each side."""

Mark = Literal["", "taken", "saved", "now", "felt"]
"""State of this answer: "" (none), taken (accepted), saved (on disk), now (being played), felt (in the
demonstration)."""


class DirectionPanel(Widget):
    """Widget with a large digit, the direction as a thick line in its colour, and its description. number: of the
    answer, 1 or 2. picture: None for an interval, which has no direction; then only the number is drawn. mark: shown as
    a word in the frame; taken, saved and now also by a heavier frame. words: texts in the language of the
    participant."""

    DEFAULT_CSS = """
    DirectionPanel {
        width: 1fr; height: 1fr; min-height: 7; border: round $foreground 40%; border-subtitle-align: center;
        border-subtitle-style: bold; border-subtitle-color: $foreground;
    }
    DirectionPanel.-taken, DirectionPanel.-saved, DirectionPanel.-now { border: heavy $foreground; }
    DirectionPanel > .direction-panel--one { color: #56B4E9; text-style: bold; }
    DirectionPanel > .direction-panel--two { color: #E69F00; text-style: bold; }
    DirectionPanel:light > .direction-panel--one { color: #0072B2; }
    DirectionPanel:light > .direction-panel--two { color: #A84A00; }
    """
    """Style sheet. Colours of the directions: blue and orange of the palette by Okabe and Ito, which can be told apart
    with a colour-vision deficiency; a darker orange on light background (chosen, for contrast)."""
    COMPONENT_CLASSES = {"direction-panel--one", "direction-panel--two"}  # noqa: RUF012  Textual's own type

    picture: reactive[DirectionPicture | None] = reactive(None)
    mark: reactive[Mark] = reactive[Mark]("")

    def __init__(self, number: int, picture: DirectionPicture | None = None, words: Words = ENGLISH_WORDS) -> None:
        super().__init__()
        self._words = words
        self.number = number
        self.set_reactive(DirectionPanel.picture, picture)

    def watch_mark(self, old_mark: Mark, new_mark: Mark) -> None:
        self.remove_class(f"-{old_mark}")
        self.set_class(bool(new_mark), f"-{new_mark}")
        self.border_subtitle = f"{self.number} {self._words[f'mark_{new_mark}']}" if new_mark else ""

    def render_line(self, y: int) -> Strip:
        width, height = self.size
        base_style = self.rich_style
        direction_style = base_style + self.get_component_rich_style(
            "direction-panel--one" if self.number == 1 else "direction-panel--two", partial=True
        )
        description_lines = self._wrap_description()
        drawing_height = height - len(description_lines)
        if y >= drawing_height:
            return Strip(
                [Segment(description_lines[y - drawing_height].center(width)[:width], base_style + Style(bold=True))],
                width,
            )
        drawing, left_margin = self._make_drawing()
        drawing_row = y - (drawing_height - len(drawing)) // 2
        row_text = drawing[drawing_row] if 0 <= drawing_row < len(drawing) else ""
        digit = LARGE_DIGITS[self.number]
        digit_row = digit[y] if y < len(digit) and self.picture is not None else ""
        text = f" {digit_row}".ljust(left_margin) + row_text
        return Strip([Segment(text.ljust(width)[:width], direction_style)], width)

    def _make_drawing(self) -> tuple[tuple[str, ...], int]:
        """Draw the direction or the number. Returns the rows, and the number of free columns to their left."""
        drawing_size = _fit_square(Size(self.size.width, self.size.height - len(self._wrap_description())))
        if self.picture is None:
            drawing = draw_large_digit(self.number, drawing_size.width, drawing_size.height)
        else:
            drawing = draw_large_direction(self.picture, self.number, drawing_size.width, drawing_size.height)
        return drawing, (self.size.width - drawing_size.width) // 2

    def _wrap_description(self) -> list[str]:
        """Wrap the description into as many lines as it needs, because a missing word could be the one in which the two
        directions differ."""
        return textwrap.wrap(self._describe_answer(), max(1, self.size.width), break_on_hyphens=False) or [""]

    def _describe_answer(self) -> str:
        """Describe the direction, or the interval where there is no picture."""
        if self.picture is None:
            return self._words["interval_first" if self.number == 1 else "interval_second"]
        return describe_direction(self.picture, self.number, self._words)


def _fit_square(available_size: Size) -> Size:
    """Compute the largest area within `available_size` (cells), less the columns of the numbers, that looks square:
    cells are taken as twice as high as wide."""
    rows = max(1, min(available_size.height, (available_size.width - 2 * DIGIT_MARGIN_COLUMNS) // 2))
    return Size(2 * rows, rows)
