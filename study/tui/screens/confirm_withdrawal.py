"""Confirmation of a withdrawal of consent during a sitting: a word must be typed."""

from typing import ClassVar

from textual import on
from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.screen import ModalScreen
from textual.widgets import Footer, Input

from study.tui.screens.help import HelpScreen
from study.tui.take_off import take_off
from study.tui.trial_words import WITHDRAW
from study.tui.widgets.card import Card
from study.tui.widgets.literal_text import LiteralText


class ConfirmWithdrawal(ModalScreen[bool]):
    """Returns True if the word was typed."""

    HELP = """\
# Taking the consent back

- A participant may take the consent back at any time, without giving a reason.
- Everything recorded of this participant is then erased, and cannot be brought back.
- Type the word and press **Enter** to erase. **Esc** keeps everything.
"""
    DEFAULT_CSS = """
    ConfirmWithdrawal { align: center middle; }
    ConfirmWithdrawal Card { border: round $error; }
    ConfirmWithdrawal Input { margin-top: 1; }
    ConfirmWithdrawal #said { height: 1; color: $text-error; }
    """
    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("escape", "leave", "Keep everything", key_display="Esc"),
        Binding("f1", "help", "Help"),
    ]

    def compose(self) -> ComposeResult:
        with Card("Take the consent back"):
            yield LiteralText("Everything recorded of this participant will be erased, and cannot be brought back.")
            yield LiteralText(
                f"To erase it, type {WITHDRAW} and press Enter. Esc keeps everything.", classes="gap strong"
            )
            yield Input(compact=True)
            yield LiteralText(id="said")
        yield Footer(show_command_palette=False)

    @on(Input.Submitted)
    def _judge(self, typed: Input.Submitted) -> None:
        if typed.value.strip().casefold() == WITHDRAW:
            take_off(self, True)
        else:
            self.query_one("#said", LiteralText).update(f"That is not the word {WITHDRAW}. Nothing is erased.")

    def action_help(self) -> None:
        self.app.push_screen(HelpScreen(self.HELP))

    def action_leave(self) -> None:
        take_off(self, False)
