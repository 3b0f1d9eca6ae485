"""Screen of the instructions that a participant reads before the first trial of a sitting."""

from typing import ClassVar

from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.containers import Horizontal
from textual.widgets import Footer

from protocols.wording.words import ENGLISH_WORDS, Words
from study.session.views.participant_views import Welcome
from study.tui.dismiss_screen import dismiss_screen
from study.tui.keys.answer_keys import DIGITS, AnswerKeys
from study.tui.translated_screen import TranslatedScreen
from study.tui.trial_words import describe_plan
from study.tui.widgets.card import Sheet
from study.tui.widgets.direction_panel import DirectionPanel
from study.tui.widgets.literal_text import LiteralText


class InstructionsScreen(TranslatedScreen[None]):
    """Screen that explains how to hold the handle, the two directions, how to answer, and the plan of the sitting. If
    the device does not move, a note states that the answers are only practice. Enter closes the screen."""

    PAGE = "help_instructions"
    DEFAULT_CSS = """
    InstructionsScreen { align: center top; }
    InstructionsScreen #pictures { height: 1fr; min-height: 8; max-height: 18; }
    InstructionsScreen .practice { border-left: thick $warning; padding-left: 1; margin-top: 1; }
    """
    BINDINGS: ClassVar[list[BindingType]] = [Binding("enter", "begin", "Begin", key_display="Enter")]

    def __init__(self, welcome: Welcome, keys: AnswerKeys = DIGITS, words: Words = ENGLISH_WORDS) -> None:
        super().__init__(words)
        self._welcome = welcome
        self._keys = keys

    def compose(self) -> ComposeResult:
        welcome, words = self._welcome, self.words
        with Sheet():
            yield LiteralText(welcome.title, classes="title")
            if welcome.resumed_after:
                yield LiteralText(words.fill_count("welcome_back", welcome.resumed_after))
            yield LiteralText(words["hold"])
            with Horizontal(id="pictures"):
                yield DirectionPanel(1, welcome.picture, words)
                yield DirectionPanel(2, welcome.picture, words)
            yield LiteralText(words.fill("how", {"keys": self._keys.describe_keys(words)}))
            yield LiteralText(describe_plan(welcome, words))
            yield LiteralText(words["stop_any_time"])
            if not welcome.device_moves:
                yield LiteralText(
                    words.fill("not_felt", {"device": words.translate_fact(welcome.device)}), classes="practice"
                )
            yield LiteralText(words["enter_begins"], classes="gap strong")
        yield Footer(show_command_palette=False)

    def action_begin(self) -> None:
        dismiss_screen(self, None)
