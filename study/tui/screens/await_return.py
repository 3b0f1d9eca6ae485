"""After a void trial: nothing is played until the participant is back."""

from typing import ClassVar

from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.screen import Screen
from textual.widgets import Footer

from study.session.facts.void_reasons import void_for_participant
from study.tui.take_off import take_off
from study.tui.widgets.card import Card
from study.tui.widgets.literal_text import LiteralText


class AwaitReturnScreen(Screen[None]):
    HELP = """\
# A trial that did not count

- The last trial was cut short and does not count. It comes again, so nothing is lost.
- Nothing is played until you press **Enter**.
- **Ctrl+C** leaves; the session can be resumed.
"""
    DEFAULT_CSS = "AwaitReturnScreen { align: center middle; }"
    BINDINGS: ClassVar[list[BindingType]] = [Binding("enter", "go_on", "Go on", key_display="Enter")]

    def __init__(self, reason: str) -> None:
        super().__init__()
        self._reason = reason

    def compose(self) -> ComposeResult:
        with Card("The last trial does not count"):
            yield LiteralText(void_for_participant(self._reason))
            yield LiteralText("All answers before it are saved, and it will come again.", classes="gap")
            yield LiteralText("Take hold of the handle and press Enter when you are ready.", classes="gap strong")
        yield Footer(show_command_palette=False)

    def action_go_on(self) -> None:
        take_off(self, None)
