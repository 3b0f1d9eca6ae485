"""Panel of one of the two answers of a trial: its number, its direction as a thick line, and its description in words.

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
from study.session.views.views import DirectionPicture
from study.tui.drawing.direction_picture import draw_large_direction, sentence
from study.tui.drawing.number_picture import large_number

NUMBERS = {1: ("╺┓ ", " ┃ ", "╺┻╸"), 2: ("┏━┓", "┏━┛", "┗━╸")}
"""Large digits, three lines each."""
NUMBER_COLUMNS = 5
"""Columns kept free for the number, left of the drawing, and as many on its right."""

Mark = Literal["", "taken", "saved", "now", "felt"]
"""State of this answer: "" (none), taken (accepted), saved (on disk), now (being played), felt (in the
demonstration)."""


class DirectionPanel(Widget):
    """Draws a large digit, the direction as a thick line in its colour, and its description. picture: None for an
    interval, which has no direction; then only the number is drawn. mark: shown as a word in the frame; taken, saved
    and now also by a heavier frame."""

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
    COMPONENT_CLASSES = {"direction-panel--one", "direction-panel--two"}  # noqa: RUF012  Textual's own type

    picture: reactive[DirectionPicture | None] = reactive(None)
    mark: reactive[Mark] = reactive[Mark]("")

    def __init__(self, number: int, picture: DirectionPicture | None = None, words: Words = ENGLISH_WORDS) -> None:
        super().__init__()
        self._texts = words
        self.number = number
        self.set_reactive(DirectionPanel.picture, picture)

    def watch_mark(self, old_mark: Mark, new_mark: Mark) -> None:
        self.remove_class(f"-{old_mark}")
        self.set_class(bool(new_mark), f"-{new_mark}")
        self.border_subtitle = f"{self.number} {self._texts[f'mark_{new_mark}']}" if new_mark else ""

    def render_line(self, y: int) -> Strip:
        width, height = self.size
        base_style = self.rich_style
        coloured = base_style + self.get_component_rich_style(
            "direction-panel--one" if self.number == 1 else "direction-panel--two", partial=True
        )
        words = self._lines()
        above = height - len(words)
        if y >= above:
            return Strip([Segment(words[y - above].center(width)[:width], base_style + Style(bold=True))], width)
        drawing, margin = self._make_drawing()
        row = y - (above - len(drawing)) // 2
        row_text = drawing[row] if 0 <= row < len(drawing) else ""
        number = NUMBERS[self.number][y] if y < 3 and self.picture is not None else ""
        text = f" {number}".ljust(margin) + row_text
        return Strip([Segment(text.ljust(width)[:width], coloured)], width)

    def _make_drawing(self) -> tuple[tuple[str, ...], int]:
        """Rows of the drawing, and the number of free columns to their left."""
        room = _room(Size(self.size.width, self.size.height - len(self._lines())))
        if self.picture is None:
            drawing = large_number(self.number, room.width, room.height)
        else:
            drawing = draw_large_direction(self.picture, self.number, room.width, room.height)
        return drawing, (self.size.width - room.width) // 2

    def _lines(self) -> list[str]:
        """The description, wrapped into as many lines as it needs: it is never cut, because the missing word could be
        the one in which the two directions differ."""
        return textwrap.wrap(self._direction_text(), max(1, self.size.width), break_on_hyphens=False) or [""]

    def _direction_text(self) -> str:
        if self.picture is None:
            return self._texts["interval_first" if self.number == 1 else "interval_second"]
        return sentence(self.picture, self.number, self._texts)


def _room(size: Size) -> Size:
    """Largest area within `size`, less the columns of the numbers, that looks square: cells are taken as twice as high
    as wide."""
    rows = max(1, min(size.height, (size.width - 2 * NUMBER_COLUMNS) // 2))
    return Size(2 * rows, rows)
