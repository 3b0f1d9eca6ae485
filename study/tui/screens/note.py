"""A note for the log by the person at the screen, or a report of an adverse event."""

from typing import ClassVar, cast

from textual import on
from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.screen import ModalScreen
from textual.widgets import Button, Footer, TextArea

from study.session.watching.requests import NoteAsked, Who
from study.tui.screens.help import HelpScreen
from study.tui.take_off import take_off
from study.tui.widgets.card import Card
from study.tui.widgets.choice_row import ChoiceRow
from study.tui.widgets.literal_text import LiteralText

MOST_CHARACTERS = 500
WRITERS: tuple[Who, ...] = ("participant", "experimenter")


class NoteScreen(ModalScreen[NoteAsked | None]):
    """Returns None if nothing is to be written."""

    HELP = """\
# A note

- Write what should be known about this session later. No names: the log is kept with the data.
- **Tab** goes on to who writes it, and whether something happened to the participant.
- **Ctrl+S** or the button writes it into the log; **Esc** leaves without writing.
- If a person was hurt, leave the handle alone and look after the participant first.
"""
    DEFAULT_CSS = """
    NoteScreen { align: center middle; }
    NoteScreen TextArea { height: 5; margin: 1 0; }
    NoteScreen Button { margin-top: 1; }
    NoteScreen #said { height: 1; color: $text-warning; }
    """
    AUTO_FOCUS = "TextArea"
    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("ctrl+s", "save", "Write it", priority=True),
        Binding("escape", "leave", "Leave", key_display="Esc"),
        Binding("f1", "help", "Help"),
    ]

    def __init__(self, adverse: bool = False, who: Who = "participant") -> None:
        super().__init__()
        self._adverse = adverse
        self._who = who

    def compose(self) -> ComposeResult:
        with Card("Something happened" if self._adverse else "A note"):
            yield LiteralText("What happened?" if self._adverse else "What is to be noted? No names, please.")
            yield TextArea(soft_wrap=True, tab_behavior="focus")
            yield LiteralText("Who writes this?")
            yield ChoiceRow(WRITERS, WRITERS.index(self._who) if self._who in WRITERS else None, id="who")
            yield LiteralText("Did something happen to the participant, such as pain, numbness or a fright?")
            yield ChoiceRow(("no", "yes"), int(self._adverse), id="adverse")
            yield Button("Write it into the log", variant="primary", compact=True)
            yield LiteralText(id="said")
        yield Footer(show_command_palette=False)

    @on(ChoiceRow.Left)
    def _next(self) -> None:
        self.focus_next()

    @on(Button.Pressed)
    def action_save(self) -> None:
        text = " ".join(self.query_one(TextArea).text.split())
        who = self.query_one("#who", ChoiceRow).answer
        if not text:
            self._refuse("Nothing is written yet. Type what happened, or press Esc to leave.")
        elif len(text) > MOST_CHARACTERS:
            self._refuse(f"At most {MOST_CHARACTERS} characters fit; these are {len(text)}.")
        elif not who:
            self._refuse("Please choose who writes this.")
        else:
            take_off(self, NoteAsked(cast(Who, who), text, self.query_one("#adverse", ChoiceRow).answer == "yes"))

    def action_leave(self) -> None:
        take_off(self, None)

    def action_help(self) -> None:
        self.app.push_screen(HelpScreen(self.HELP))

    def _refuse(self, sentence: str) -> None:
        self.query_one("#said", LiteralText).update(sentence)
