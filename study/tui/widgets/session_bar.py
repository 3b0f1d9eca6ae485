"""Progress line of the trial screen (`study.tui.screens.trial`): position in the session, progress bar and minutes
left."""

from rich.segment import Segment
from rich.style import Style
from textual.reactive import reactive
from textual.strip import Strip
from textual.widget import Widget

from protocols.wording.words import ENGLISH_WORDS, Words
from study.session.views.participant_views import Progress

DONE_CHAR, REMAINING_CHAR = "━", "─"
"""Characters of the bar, for the part that is done and the part that remains."""
MIN_BAR_WIDTH, MAX_BAR_WIDTH = 8, 40
"""Characters of the shortest bar that shows progress, and of the longest (chosen: longer shows no more detail)."""


class SessionBar(Widget):
    """Widget of one line. Left: run and trial. Right: progress bar, percentage done, and estimated minutes left."""

    DEFAULT_CSS = """
    SessionBar { height: 1; padding: 0 1; background: $panel; color: $foreground; }
    """

    heading: reactive[str] = reactive("")
    """Text on the left: run and trial."""
    progress: reactive[Progress | None] = reactive[Progress | None](None)
    """Share of the session that is done, and minutes left; None: nothing is shown on the right."""

    def __init__(self, words: Words = ENGLISH_WORDS) -> None:
        """words: texts in the language of the participant."""
        super().__init__()
        self._words = words

    def render_line(self, y: int) -> Strip:
        """Draw the line. The bar has at most a quarter of the width. The heading is cut where the shortest bar leaves
        too little room."""
        width = self.size.width
        available_bar_width = width - len(self.heading) - 1 - len(self._format_progress(0))
        right_text = self._format_progress(max(MIN_BAR_WIDTH, min(MAX_BAR_WIDTH, width // 4, available_bar_width)))
        left_text = self.heading[: max(0, width - len(right_text) - 1)]
        gap = " " * (width - len(left_text) - len(right_text))
        style = self.rich_style
        return Strip([Segment(left_text, style + Style(bold=True)), Segment(gap + right_text, style)], width).crop(
            0, width
        )

    def _format_progress(self, bar_width: int) -> str:
        """Format the bar (`bar_width` characters), the percentage and the minutes left; empty where `progress` is None.
        The minutes are left out where they are unknown."""
        if self.progress is None:
            return ""
        done_width = min(bar_width, round(self.progress.share_done * bar_width))
        minutes_left = self.progress.minutes_left
        minutes_text = "" if minutes_left is None else f"  {self._words.fill('bar_left', {'minutes': minutes_left})}"
        return (
            f"{DONE_CHAR * done_width}{REMAINING_CHAR * (bar_width - done_width)} "
            f"{self.progress.share_done:4.0%}{minutes_text}"
        )
