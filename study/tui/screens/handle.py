"""Screen before a trial: it shows where the handle is, and where the participant must move it."""

from typing import ClassVar

from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.widgets import Footer

from protocols.wording.words import ENGLISH_WORDS, Words
from study.session.views.participant_views import HandleView, Unanswered
from study.tui.dismiss_screen import dismiss_screen
from study.tui.translated_screen import TranslatedScreen
from study.tui.trial_replies import LEAVING, PAUSE
from study.tui.widgets.handle_target import HandleTarget
from study.tui.widgets.literal_text import LiteralText


class HandleScreen(TranslatedScreen[Unanswered | None]):
    """Draws the position of the handle and its target. p pauses, q leaves; otherwise the application closes the screen
    when the wait for the handle ends."""

    PAGE = "help_handle"
    DEFAULT_CSS = """
    HandleScreen #title { height: auto; min-height: 1; margin: 1 1 1 1; text-align: center; text-style: bold; }
    HandleScreen HandleTarget { margin: 0 1; }
    HandleScreen #sentence { height: 2; margin: 1 1 0 1; text-align: center; text-style: bold; }
    """
    AUTO_FOCUS = ""
    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("p", "pause", "Pause"),
        Binding("q", "leave", "Leave"),
    ]

    def __init__(self, view: HandleView, words: Words = ENGLISH_WORDS) -> None:
        super().__init__(words)
        self._view = view

    def compose(self) -> ComposeResult:
        yield LiteralText(self.words["handle_title"], id="title")
        yield HandleTarget()
        yield LiteralText(id="sentence")
        yield Footer(show_command_palette=False)

    def on_mount(self) -> None:
        self.update_view(self._view)

    def update_view(self, view: HandleView) -> None:
        """Draw a new position of the handle; before the first frame, with that."""
        self._view = view
        if self.query(HandleTarget):  # False before the first frame
            self.query_one(HandleTarget).view = view
            self.query_one("#sentence", LiteralText).update(self.words.translate_fact(view.sentence))

    def action_pause(self) -> None:
        dismiss_screen(self, PAUSE)

    def action_leave(self) -> None:
        dismiss_screen(self, LEAVING)
