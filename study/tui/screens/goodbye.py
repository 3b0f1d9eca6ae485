"""The end of a sitting, finished or not."""

from typing import ClassVar

from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.screen import Screen
from textual.widgets import Footer

from study.session.views.counted import answers_are
from study.session.views.views import Goodbye
from study.tui.take_off import take_off
from study.tui.trial_words import refusal_words
from study.tui.widgets.card import Card
from study.tui.widgets.literal_text import LiteralText


class GoodbyeScreen(Screen[None]):
    HELP = """\
# The end

- The device is still, and every answer is on the disk.
- A session that is not finished can be resumed another day, at the trial where it stopped.
- **Enter** closes this page.
"""
    DEFAULT_CSS = "GoodbyeScreen { align: center middle; }"
    BINDINGS: ClassVar[list[BindingType]] = [Binding("enter", "close_page", "Close", key_display="Enter")]

    def __init__(self, notice: Goodbye) -> None:
        super().__init__()
        self._notice = notice

    def compose(self) -> ComposeResult:
        notice = self._notice
        with Card("Thank you" if notice.outcome else "Finished" if notice.finished else "The end of this sitting"):
            if notice.outcome:
                for sentence in refusal_words(notice.outcome):
                    yield LiteralText(sentence, classes="strong")
            elif notice.finished:
                yield LiteralText("Thank you! This was the last trial.", classes="strong")
            else:
                yield LiteralText(f"Thank you. The session stops here{_because(notice.reason)}.", classes="strong")
            if notice.answers:
                yield LiteralText(f"{answers_are(notice.answers)} on the disk.", classes="gap")
            if notice.answers and not notice.finished:
                yield LiteralText("It can be resumed at the trial where it stopped.", classes="gap")
            held = "" if notice.outcome else "You may let go of the handle. "
            yield LiteralText(f"{held}Press Enter to close this page.", classes="gap")
        yield Footer(show_command_palette=False)

    def action_close_page(self) -> None:
        take_off(self, None)


def _because(reason: str) -> str:
    return f": {reason}" if reason else ""
