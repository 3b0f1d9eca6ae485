"""Dialog that asks for a word to be typed, so that no single key that is pressed by mistake confirms anything."""

from collections.abc import Callable
from typing import ClassVar

from textual import on
from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.screen import ModalScreen
from textual.widgets import Footer, Input

from protocols.wording.words import ENGLISH_WORDS, Words
from study.tui.dismiss_screen import dismiss_screen
from study.tui.screens.help import HelpScreen
from study.tui.translated_screen import TranslatedScreen
from study.tui.widgets.card import Card
from study.tui.widgets.literal_text import LiteralText


class TypedConfirmation(TranslatedScreen[bool], ModalScreen[bool]):
    """Asks for a word. Enter returns True if the typed text without surrounding blanks is the word, and else shows a
    message; Esc returns False. Subclasses state the help."""

    DEFAULT_CSS = """
    TypedConfirmation { align: center middle; }
    TypedConfirmation Card { border: round $error; }
    TypedConfirmation Input { margin-top: 1; }
    TypedConfirmation #message { height: auto; min-height: 1; color: $text-error; }
    """
    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("escape", "leave", "Keep everything", key_display="Esc"),
        Binding("f1", "help", "Help"),  # a modal screen does not receive the application's own bindings
    ]

    def __init__(
        self,
        word: str,
        title: str,
        paragraphs: tuple[str, ...],
        describe_refusal: Callable[[], str],
        words: Words = ENGLISH_WORDS,
    ) -> None:
        """paragraphs: text of the dialog; the last says what to type. describe_refusal: gives the message for another
        text. words: texts of the footer."""
        super().__init__(words)
        self._word = word
        self._title = title
        self._paragraphs = paragraphs
        self._describe_refusal = describe_refusal

    def compose(self) -> ComposeResult:
        with Card(self._title):
            for number, paragraph in enumerate(self._paragraphs, start=1):
                is_last = number == len(self._paragraphs)
                yield LiteralText(paragraph, classes="gap strong" if is_last else "gap" if number > 1 else "")
            yield Input(compact=True)
            yield LiteralText(id="message")
        yield Footer(show_command_palette=False)

    def is_word(self, text: str) -> bool:
        """Whether a typed text without surrounding blanks is the word."""
        return text == self._word

    @on(Input.Submitted)
    def _check_input(self, event: Input.Submitted) -> None:
        if self.is_word(event.value.strip()):
            dismiss_screen(self, True)
        else:
            self.query_one("#message", LiteralText).update(self._describe_refusal())

    def action_help(self) -> None:
        self.app.push_screen(HelpScreen(self.HELP, self.words))

    def action_leave(self) -> None:
        dismiss_screen(self, False)
