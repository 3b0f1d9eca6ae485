"""Screen while a stimulus of fixed duration plays without a question: an interval, a demonstration, or a probe.

A probe is a stimulus that measures the device, to which the participant does not respond.
"""

from typing import ClassVar

from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.containers import Horizontal
from textual.widgets import Footer

from protocols.wording.words import ENGLISH_WORDS, Words
from study.session.views.participant_views import PlayingNotice, Unanswered
from study.tui.dismiss_screen import dismiss_screen
from study.tui.translated_screen import TranslatedScreen
from study.tui.trial_replies import LEAVING, PAUSE
from study.tui.widgets.direction_panel import DirectionPanel
from study.tui.widgets.literal_text import LiteralText


class PlayingScreen(TranslatedScreen[Unanswered | None]):
    """Screen that highlights the direction or interval that plays, or shows the title of the probe. It is dismissed
    with `PAUSE` (key p) or `LEAVING` (key q); the application removes it at the end of the stimulus, without a
    result."""

    PAGE = "help_playing"
    DEFAULT_CSS = """
    PlayingScreen #title { height: auto; min-height: 1; margin: 2 1 0 1; text-align: center; text-style: bold; }
    PlayingScreen #answers { height: 1fr; margin: 0 1; }
    PlayingScreen #message { height: 3; margin: 0 1; text-align: center; }
    """
    AUTO_FOCUS = ""
    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("p", "pause", "Pause"),
        Binding("q", "leave", "Leave"),
    ]

    def __init__(self, notice: PlayingNotice, words: Words = ENGLISH_WORDS) -> None:
        super().__init__(words)
        self._notice = notice

    def compose(self) -> ComposeResult:
        notice, words = self._notice, self.words
        yield LiteralText(words.translate_fact(notice.title), id="title")
        if notice.title and not notice.number:  # a probe, after which no question is asked
            yield LiteralText(words["playing_no_key"], id="message")
            yield Footer(show_command_palette=False)
            return
        with Horizontal(id="answers"):
            for number in (1, 2):
                panel = DirectionPanel(number, notice.picture, words)
                # The gap between two intervals has no title, and nothing is highlighted.
                panel.mark = "now" if notice.title and number == notice.number else ""
                yield panel
        yield LiteralText(words["playing_only_feel" if notice.title else "playing_gap"], id="message")
        yield Footer(show_command_palette=False)

    def action_pause(self) -> None:
        dismiss_screen(self, PAUSE)

    def action_leave(self) -> None:
        dismiss_screen(self, LEAVING)
