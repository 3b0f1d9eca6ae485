"""Help on a screen, as a dialog above it."""

from typing import ClassVar

from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.containers import VerticalScroll
from textual.screen import ModalScreen
from textual.widgets import Footer

from protocols.wording.words import ENGLISH_WORDS, Words
from study.tui.dismiss_screen import dismiss_screen
from study.tui.translated_screen import TranslatedScreen


class HelpScreen(TranslatedScreen[None], ModalScreen[None]):
    """Dialog with a help text; Esc, F1, q or ? closes it."""

    CSS = """
    HelpScreen { align: center middle; }
    HelpScreen VerticalScroll {
        max-width: 90; height: 90%; padding: 0 1; border: round $primary; background: $surface;
    }
    HelpScreen Markdown { background: $surface; }
    """
    BINDINGS: ClassVar[list[BindingType]] = [Binding("escape,f1,q,question_mark", "leave", "Back", key_display="Esc")]

    def __init__(self, text: str, words: Words = ENGLISH_WORDS) -> None:
        """text: help text in Markdown. words: texts of title and footer in the language of the participant."""
        super().__init__(words)
        self._text = text

    def compose(self) -> ComposeResult:
        from textual.widgets import Markdown  # imported here, because it is slow and the first frame does not need it

        with VerticalScroll() as dialog:
            dialog.border_title = self.words["help_title"]
            yield Markdown(self._text)
        yield Footer()

    def action_leave(self) -> None:
        dismiss_screen(self, None)
