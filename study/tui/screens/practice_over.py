"""Result of a short practice."""

from typing import ClassVar

from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.screen import Screen
from textual.widgets import Footer

from study.session.views.views import PracticeResult
from study.tui.take_off import take_off
from study.tui.widgets.card import Card
from study.tui.widgets.literal_text import LiteralText


class PracticeOverScreen(Screen[None]):
    HELP = """\
# End of a practice

- The practice shows what each vibration feels like. Its answers enter no result.
- Some vibrations are hard to tell for everyone. The study goes on all the same.
- **Enter** goes on.
"""
    DEFAULT_CSS = "PracticeOverScreen { align: center middle; }"
    BINDINGS: ClassVar[list[BindingType]] = [Binding("enter", "go_on", "Go on", key_display="Enter")]

    def __init__(self, result: PracticeResult) -> None:
        super().__init__()
        self._result = result

    def compose(self) -> ComposeResult:
        result = self._result
        with Card("End of this practice"):
            yield LiteralText(f"{result.right} of the last {result.of} answers were right.", classes="strong")
            if result.passed:
                yield LiteralText("That is enough to go on.", classes="gap")
            else:
                yield LiteralText(
                    "Some vibrations are hard to tell for everyone. The study goes on all the same.", classes="gap"
                )
            yield LiteralText("Press Enter to go on.", classes="gap")
        yield Footer(show_command_palette=False)

    def action_go_on(self) -> None:
        take_off(self, None)
