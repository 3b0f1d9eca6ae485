"""Last screen of a sitting: how it ended, and how many answers are saved."""

from typing import ClassVar

from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.widgets import Footer

from protocols.wording.words import ENGLISH_WORDS, Words
from study.session.views.participant_views import Goodbye
from study.tui.dismiss_screen import dismiss_screen
from study.tui.translated_screen import TranslatedScreen
from study.tui.trial_words import describe_refusal
from study.tui.widgets.card import Card
from study.tui.widgets.literal_text import LiteralText


class GoodbyeScreen(TranslatedScreen[None]):
    """Shows that the session is finished, that the sitting stopped, or that the person does not take part; and the
    number of saved answers, if there are any. Enter closes the screen."""

    PAGE = "help_goodbye"
    DEFAULT_CSS = "GoodbyeScreen { align: center middle; }"
    BINDINGS: ClassVar[list[BindingType]] = [Binding("enter", "close_page", "Close", key_display="Enter")]

    def __init__(self, notice: Goodbye, words: Words = ENGLISH_WORDS) -> None:
        super().__init__(words)
        self._notice = notice

    def compose(self) -> ComposeResult:
        notice, words = self._notice, self.words
        title = "end_thanks" if notice.outcome else "end_finished" if notice.finished else "end_sitting"
        with Card(words[title]):
            if notice.outcome:
                for sentence in describe_refusal(notice.outcome, words):
                    yield LiteralText(sentence, classes="strong")
            elif notice.finished:
                yield LiteralText(words["end_last_trial"], classes="strong")
            else:
                reason = {"reason": words.translate_fact(notice.reason)}
                stop_text = words.fill("end_stops_because", reason) if notice.reason else words["end_stops"]
                yield LiteralText(stop_text, classes="strong")
            if notice.answers:
                yield LiteralText(words.fill_count("saved", notice.answers), classes="gap")
            if notice.answers and not notice.finished:
                yield LiteralText(words["end_resume"], classes="gap")
            let_go_text = "" if notice.outcome else f"{words['end_let_go']} "
            yield LiteralText(f"{let_go_text}{words['end_close']}", classes="gap")
        yield Footer(show_command_palette=False)

    def action_close_page(self) -> None:
        dismiss_screen(self, None)
