"""Screen of a pause: no stimulus is played until the participant decides to continue, to leave or to withdraw.

A note or an adverse event can be written into the log from here.
"""

from dataclasses import dataclass
from typing import ClassVar

from textual import on
from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.message import Message
from textual.widgets import Footer, OptionList
from textual.widgets.option_list import Option

from protocols.wording.words import ENGLISH_WORDS, Words
from study.session.views.participant_views import AfterPause, PauseNotice
from study.session.watching.requests import NoteAsked
from study.tui.dismiss_screen import dismiss_screen
from study.tui.screens.confirm_withdrawal import ConfirmWithdrawal
from study.tui.screens.note import NoteScreen
from study.tui.translated_screen import TranslatedScreen
from study.tui.widgets.card import Card
from study.tui.widgets.literal_text import LiteralText

DECISION_TEXT_KEYS = {
    AfterPause.CONTINUE_SITTING: "pause_go_on",
    AfterPause.END_SITTING: "pause_leave",
    AfterPause.WITHDRAW: "pause_withdraw",
}
"""Key of the text of each decision in `Words`, in the order of the list."""


class PauseScreen(TranslatedScreen[AfterPause]):
    """Screen with the reason of the pause and the number of saved answers. Arrow keys and Enter choose a decision, its
    result; n writes a note, e an adverse event (message `NoteWritten`). leave_requested: the participant asked to
    leave, so that this choice is highlighted at first."""

    PAGE = "help_pause"
    DEFAULT_CSS = """
    PauseScreen { align: center middle; }
    PauseScreen OptionList, PauseScreen OptionList:focus {
        height: auto; border: none; padding: 0; margin-top: 1; background: transparent;
    }
    PauseScreen #message { height: auto; min-height: 1; margin-top: 1; text-style: bold; }
    """
    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("n", "note(False)", "Note"),
        Binding("e", "note(True)", "Something happened"),
        Binding("enter", "choose", "Choose", key_display="Enter", priority=True),
    ]

    @dataclass
    class NoteWritten(Message):
        """A note or an adverse event to be written into the log."""

        note: NoteAsked

    def __init__(self, notice: PauseNotice, leave_requested: bool = False, words: Words = ENGLISH_WORDS) -> None:
        super().__init__(words)
        self._notice = notice
        self._leave_requested = leave_requested

    def compose(self) -> ComposeResult:
        words = self.words
        with Card(words["pause_title"]):
            yield LiteralText(words["pause_free"], classes="strong")
            yield LiteralText(
                words.fill("pause_reason", {"reason": words.translate_fact(self._notice.reason)}), classes="gap"
            )
            yield LiteralText(words.fill_count("saved", self._notice.answers))
            yield OptionList(
                *(Option(words[key], id=choice.value) for choice, key in DECISION_TEXT_KEYS.items()), markup=False
            )
            yield LiteralText(id="message")
        yield Footer(show_command_palette=False)

    def on_mount(self) -> None:
        first_choice = AfterPause.END_SITTING if self._leave_requested else AfterPause.CONTINUE_SITTING
        self.query_one(OptionList).highlighted = list(DECISION_TEXT_KEYS).index(first_choice)

    @on(OptionList.OptionSelected)
    def _decide(self, selected: OptionList.OptionSelected) -> None:
        """Return the chosen decision; a withdrawal after a confirmation only."""
        choice = AfterPause(selected.option.id)
        if choice is AfterPause.WITHDRAW:
            self.app.push_screen(ConfirmWithdrawal(self.words), self._withdraw)
        else:
            dismiss_screen(self, choice)

    def action_choose(self) -> None:
        self.query_one(OptionList).action_select()

    def action_note(self, adverse: bool) -> None:
        self.app.push_screen(NoteScreen(adverse, words=self.words), self._take_note)

    def _withdraw(self, confirmed: bool | None) -> None:
        """Return the decision to withdraw if it was confirmed; otherwise stay in the pause."""
        if confirmed:
            dismiss_screen(self, AfterPause.WITHDRAW)
        else:
            self.query_one("#message", LiteralText).update(self.words["nothing_erased"])

    def _take_note(self, note: NoteAsked | None) -> None:
        """Post a written note, and state that it is logged; None: the dialog was cancelled, and nothing is written."""
        if note is None:
            self.query_one("#message", LiteralText).update(self.words["nothing_written"])
            return
        self.post_message(self.NoteWritten(note))
        self.query_one("#message", LiteralText).update(self.words["goes_into_log"])
