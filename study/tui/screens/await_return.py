"""Screen after a void trial: it gives the reason, and no stimulus is played until the participant presses Enter."""

from typing import ClassVar

from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.widgets import Footer

from protocols.wording.words import ENGLISH_WORDS, Words
from study.tui.dismiss_screen import dismiss_screen
from study.tui.translated_screen import TranslatedScreen
from study.tui.trial_words import describe_void_trial
from study.tui.widgets.card import Card
from study.tui.widgets.literal_text import LiteralText


class AwaitReturnScreen(TranslatedScreen[None]):
    """Shows why the trial is void; Enter continues. reason: cause of the void trial, as in the log."""

    PAGE = "help_void"
    DEFAULT_CSS = "AwaitReturnScreen { align: center middle; }"
    BINDINGS: ClassVar[list[BindingType]] = [Binding("enter", "go_on", "Go on", key_display="Enter")]

    def __init__(self, reason: str, words: Words = ENGLISH_WORDS) -> None:
        super().__init__(words)
        self._reason = reason

    def compose(self) -> ComposeResult:
        with Card(self.words["void_title"]):
            yield LiteralText(describe_void_trial(self._reason, self.words))
            yield LiteralText(self.words["void_saved"], classes="gap")
            yield LiteralText(self.words["void_ready"], classes="gap strong")
        yield Footer(show_command_palette=False)

    def action_go_on(self) -> None:
        dismiss_screen(self, None)
