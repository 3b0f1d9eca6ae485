"""Screen after a practice run: number of correct answers, and whether the criterion of the practice was met."""

from typing import ClassVar

from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.widgets import Footer

from protocols.wording.words import ENGLISH_WORDS, Words
from study.session.views.participant_views import PracticeResult
from study.tui.dismiss_screen import dismiss_screen
from study.tui.translated_screen import TranslatedScreen
from study.tui.widgets.card import Card
from study.tui.widgets.literal_text import LiteralText


class PracticeOverScreen(TranslatedScreen[None]):
    """Shows how many of the last answers were correct, and whether that meets the criterion; Enter closes it."""

    PAGE = "help_practice"
    DEFAULT_CSS = "PracticeOverScreen { align: center middle; }"
    BINDINGS: ClassVar[list[BindingType]] = [Binding("enter", "go_on", "Go on", key_display="Enter")]

    def __init__(self, result: PracticeResult, words: Words = ENGLISH_WORDS) -> None:
        super().__init__(words)
        self._result = result

    def compose(self) -> ComposeResult:
        result, words = self._result, self.words
        counts = {"right": result.correct_count, "asked": result.answer_count}
        with Card(words["practice_title"]):
            yield LiteralText(words.fill("practice_right", counts), classes="strong")
            yield LiteralText(words["practice_enough" if result.passed else "practice_hard"], classes="gap")
            yield LiteralText(words["enter_goes_on"], classes="gap")
        yield Footer(show_command_palette=False)

    def action_go_on(self) -> None:
        dismiss_screen(self, None)
