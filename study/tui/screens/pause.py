"""A pause: nothing is played until the participant decides how to continue. Notes are taken here."""

from dataclasses import dataclass
from typing import ClassVar

from textual import on
from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.message import Message
from textual.screen import Screen
from textual.widgets import Footer, OptionList
from textual.widgets.option_list import Option

from study.session.views.counted import answers_are
from study.session.views.views import AfterPause, PauseNotice
from study.session.watching.requests import NoteAsked
from study.tui.screens.confirm_withdrawal import ConfirmWithdrawal
from study.tui.screens.note import NoteScreen
from study.tui.take_off import take_off
from study.tui.widgets.card import Card
from study.tui.widgets.literal_text import LiteralText

CHOICES = {
    AfterPause.GO_ON: "Go on with the study",
    AfterPause.LEAVE: "Leave; the session can be resumed another day",
    AfterPause.WITHDRAW: "Take the consent back; everything is erased",
}


class PauseScreen(Screen[AfterPause]):
    """leaving: the participant asked to leave, so that choice is highlighted."""

    HELP = """\
# Pause

- Nothing is played, and the handle is free. Take as long as you like.
- **Up** and **Down** choose how to go on, **Enter** does it.
- **n** writes a note into the log; **e** reports that something happened to the participant.
- Leaving keeps every answer: the session can be resumed at this trial.
- Taking the consent back erases everything, and asks once more before it does.
"""
    DEFAULT_CSS = """
    PauseScreen { align: center middle; }
    PauseScreen OptionList, PauseScreen OptionList:focus {
        height: auto; border: none; padding: 0; margin-top: 1; background: transparent;
    }
    PauseScreen #said { height: 1; margin-top: 1; text-style: bold; }
    """
    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("n", "note(False)", "Note"),
        Binding("e", "note(True)", "Something happened"),
        Binding("enter", "choose", "Choose", key_display="Enter", priority=True),
    ]

    @dataclass
    class NoteWritten(Message):
        note: NoteAsked

    def __init__(self, notice: PauseNotice, leaving: bool = False) -> None:
        super().__init__()
        self._notice = notice
        self._leaving = leaving

    def compose(self) -> ComposeResult:
        answers = self._notice.answers
        with Card("Pause"):
            yield LiteralText("Nothing is played. You may let go of the handle.", classes="strong")
            yield LiteralText(f"Reason: {self._notice.reason}.", classes="gap")
            yield LiteralText(f"{answers_are(answers)} on the disk.")
            yield OptionList(*(Option(words, id=choice.value) for choice, words in CHOICES.items()), markup=False)
            yield LiteralText(id="said")
        yield Footer(show_command_palette=False)

    def on_mount(self) -> None:
        first = AfterPause.LEAVE if self._leaving else AfterPause.GO_ON
        self.query_one(OptionList).highlighted = list(CHOICES).index(first)

    @on(OptionList.OptionSelected)
    def _decide(self, selected: OptionList.OptionSelected) -> None:
        choice = AfterPause(selected.option.id)
        if choice is AfterPause.WITHDRAW:
            self.app.push_screen(ConfirmWithdrawal(), self._withdraw)
        else:
            take_off(self, choice)

    def action_choose(self) -> None:
        self.query_one(OptionList).action_select()

    def action_note(self, adverse: bool) -> None:
        self.app.push_screen(NoteScreen(adverse), self._take_note)

    def _withdraw(self, confirmed: bool | None) -> None:
        if confirmed:
            take_off(self, AfterPause.WITHDRAW)
        else:
            self.query_one("#said", LiteralText).update("Nothing is erased.")

    def _take_note(self, note: NoteAsked | None) -> None:
        if note is None:
            self.query_one("#said", LiteralText).update("Nothing was written.")
            return
        self.post_message(self.NoteWritten(note))
        self.query_one("#said", LiteralText).update("It goes into the log.")
