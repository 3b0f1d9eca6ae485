"""Scrolling view of many lines of text: only visible lines are drawn, and long lines are wrapped."""

import re
import textwrap

from rich.segment import Segment
from textual.geometry import Size
from textual.scroll_view import ScrollView
from textual.strip import Strip

_LINE_LABEL = re.compile(r".{1,16}?\s{2,}")
"""Label at the start of a line, such as a time: 1 to 16 characters and at least two blanks. Continuation lines are
indented by its length."""


class LongText(ScrollView, can_focus=True):
    """Widget for lines of text, wrapped at its width; arrow and page keys scroll."""

    DEFAULT_CSS = "LongText { background: $background; }"

    def __init__(self, lines: tuple[str, ...]) -> None:
        super().__init__()
        self._lines = lines
        self._wrapped_lines: list[str] = []
        self._wrap_width = 0

    def on_resize(self) -> None:
        self._wrap_lines(self.scrollable_content_region.width)

    def render_line(self, y: int) -> Strip:
        line_index = y + self.scroll_offset.y
        text = self._wrapped_lines[line_index] if line_index < len(self._wrapped_lines) else ""
        width = self.scrollable_content_region.width
        return Strip([Segment(text, self.rich_style)]).adjust_cell_length(width, self.rich_style)

    def _wrap_lines(self, width: int) -> None:
        """Wrap all lines to `width` characters and redraw, unless they are wrapped to this width already or it is 0."""
        if width <= 0 or width == self._wrap_width:
            return
        self._wrap_width = width
        self._wrapped_lines = [wrapped_line for line in self._lines for wrapped_line in _wrap_line(line, width)]
        self.virtual_size = Size(width, len(self._wrapped_lines))
        self.refresh()


def _wrap_line(line: str, width: int) -> list[str]:
    """Wrap a line to `width` characters. Continuation lines are indented by the label, if it is shorter than half the
    width."""
    if len(line) <= width:
        return [line]
    label = _LINE_LABEL.match(line)
    indent = " " * label.end() if label and label.end() < width // 2 else ""
    return textwrap.wrap(line, width, subsequent_indent=indent) or [""]
