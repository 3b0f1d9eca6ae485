"""Confirmation of a withdrawal of consent during a sitting, which erases the participant's data.

A word must be typed, in the language of the protocol, so that no single key erases data.
"""

from typing import ClassVar

from textual import on
from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.screen import ModalScreen
from textual.widgets import Footer, Input

from study.tui.dismiss_screen import dismiss_screen
from study.tui.screens.help import HelpScreen
from study.tui.translated_screen import TranslatedScreen
from study.tui.widgets.card import Card
from study.tui.widgets.literal_text import LiteralText


class ConfirmWithdrawal(TranslatedScreen[bool], ModalScreen[bool]):
    """Dialog that asks the participant to type the word. Enter returns True if the typed text equals it, without regard
    to case and surrounding blanks, and otherwise asks again; Esc returns False. The caller erases the data."""

    PAGE = "help_withdraw"
    DEFAULT_CSS = """
    ConfirmWithdrawal { align: center middle; }
    ConfirmWithdrawal Card { border: round $error; }
    ConfirmWithdrawal Input { margin-top: 1; }
    ConfirmWithdrawal #message { height: auto; min-height: 1; color: $text-error; }
    """
    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("escape", "leave", "Keep everything", key_display="Esc"),
        Binding("f1", "help", "Help"),
    ]

    def compose(self) -> ComposeResult:
        words = self.words
        with Card(words["withdraw_title"]):
            yield LiteralText(words["withdraw_all"])
            yield LiteralText(words.fill("withdraw_how", {"word": words["withdraw_word"]}), classes="gap strong")
            yield Input(compact=True)
            yield LiteralText(id="message")
        yield Footer(show_command_palette=False)

    @on(Input.Submitted)
    def _check_input(self, event: Input.Submitted) -> None:
        word = self.words["withdraw_word"]
        if event.value.strip().casefold() == word.casefold():
            dismiss_screen(self, True)
        else:
            self.query_one("#message", LiteralText).update(self.words.fill("withdraw_other", {"word": word}))

    def action_help(self) -> None:
        self.app.push_screen(HelpScreen(self.HELP, self.words))

    def action_leave(self) -> None:
        dismiss_screen(self, False)
