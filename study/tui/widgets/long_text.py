"""Scrolling view of many lines of text: only visible lines are drawn, and long lines are wrapped between words."""

import re
import textwrap

from rich.segment import Segment
from textual.geometry import Size
from textual.scroll_view import ScrollView
from textual.strip import Strip

_LINE_HEAD = re.compile(r".{1,16}?\s{2,}")
"""A time or name at the start of a line, followed by two spaces or more: continuation lines are indented by its
length."""


class LongText(ScrollView, can_focus=True):
    """Lines of text, wrapped at the width of the widget and drawn as they scroll into view; arrow and page keys
    scroll."""

    DEFAULT_CSS = "LongText { background: $background; }"

    def __init__(self, lines: tuple[str, ...], *, id: str | None = None) -> None:
        super().__init__(id=id)
        self._lines = lines
        self._wrapped: list[str] = []
        self._width = 0

    def show(self, lines: tuple[str, ...]) -> None:
        """Replace the lines."""
        self._lines, self._width = lines, 0
        self._wrap(self.scrollable_content_region.width)

    def on_resize(self) -> None:
        self._wrap(self.scrollable_content_region.width)

    def render_line(self, y: int) -> Strip:
        index = y + self.scroll_offset.y
        text = self._wrapped[index] if index < len(self._wrapped) else ""
        width = self.scrollable_content_region.width
        return Strip([Segment(text, self.rich_style)]).adjust_cell_length(width, self.rich_style)

    def _wrap(self, width: int) -> None:
        """Wrap all lines to `width` cells, unless they are wrapped to it already."""
        if width <= 0 or width == self._width:
            return
        self._width = width
        self._wrapped = [part for line in self._lines for part in _parts(line, width)]
        self.virtual_size = Size(width, len(self._wrapped))
        self.refresh()


def _parts(line: str, width: int) -> list[str]:
    """A line wrapped to `width` characters, continuation lines indented; not indented by half the width or more."""
    if len(line) <= width:
        return [line]
    head = _LINE_HEAD.match(line)
    indent = " " * head.end() if head and head.end() < width // 2 else ""
    return textwrap.wrap(line, width, subsequent_indent=indent) or [""]
