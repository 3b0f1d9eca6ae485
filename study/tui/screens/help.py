"""Help on any screen, as a dialog above it. The text comes from that screen's attribute `HELP`."""

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
    """Shows a help text in Markdown; Esc, F1, q or ? returns to the screen below. words: language of title and
    footer."""

    CSS = """
    HelpScreen { align: center middle; }
    HelpScreen VerticalScroll {
        max-width: 90; height: 90%; padding: 0 1; border: round $primary; background: $surface;
    }
    HelpScreen Markdown { background: $surface; }
    """
    BINDINGS: ClassVar[list[BindingType]] = [Binding("escape,f1,q,question_mark", "leave", "Back", key_display="Esc")]

    def __init__(self, text: str, words: Words = ENGLISH_WORDS) -> None:
        super().__init__(words)
        self._text = text

    def compose(self) -> ComposeResult:
        from textual.widgets import Markdown  # a slow import, which the first frame does not need

        with VerticalScroll() as box:
            box.border_title = self.words["help_title"]
            yield Markdown(self._text)
        yield Footer()

    def action_leave(self) -> None:
        dismiss_screen(self, None)
