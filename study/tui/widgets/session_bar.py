"""Widget above a trial: one line with the position in the session, a progress bar and the estimated minutes left."""

from rich.segment import Segment
from rich.style import Style
from textual.reactive import reactive
from textual.strip import Strip
from textual.widget import Widget

from protocols.wording.words import ENGLISH_WORDS, Words
from study.session.views.views import Progress

DONE, REMAINING = "━", "─"
"""Characters of the bar: done, and still to do."""


class SessionBar(Widget):
    """One line: run and trial on the left; on the right the bar, the share of the session that is done, and the minutes
    left."""

    DEFAULT_CSS = """
    SessionBar { height: 1; padding: 0 1; background: $panel; color: $foreground; }
    """

    heading: reactive[str] = reactive("")
    """Run and trial, in words."""
    progress: reactive[Progress | None] = reactive[Progress | None](None)
    """Share done and minutes left; None shows no bar."""

    def __init__(self, words: Words = ENGLISH_WORDS) -> None:
        """words: texts of the participant's language."""
        super().__init__()
        self._words = words

    def render_line(self, y: int) -> Strip:
        """The line as Textual draws it. The heading is cut only where the shortest bar, 8 columns, leaves no room."""
        width = self.size.width
        # The bar has at most 40 columns or a quarter of the width; it shrinks to 8, so that the words are not cut off.
        room = width - len(self.heading) - 1 - len(self._progress_text(0))
        right_text = self._progress_text(max(8, min(40, width // 4, room)))
        left_text = self.heading[: max(0, width - len(right_text) - 1)]
        gap = " " * (width - len(left_text) - len(right_text))
        style = self.rich_style
        return Strip([Segment(left_text, style + Style(bold=True)), Segment(gap + right_text, style)], width).crop(
            0, width
        )

    def _progress_text(self, bar: int) -> str:
        """The bar, `bar` columns wide, the share and the minutes left; empty without progress."""
        if self.progress is None:
            return ""
        done = min(bar, round(self.progress.share_done * bar))
        minutes = self.progress.minutes_left
        minutes_text = "" if minutes is None else f"  {self._words.fill('bar_left', {'minutes': minutes})}"
        return f"{DONE * done}{REMAINING * (bar - done)} {self.progress.share_done:4.0%}{minutes_text}"
