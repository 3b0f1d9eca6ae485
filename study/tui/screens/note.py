"""Dialog to write a note into the session's log, or to report an adverse event such as pain.

A note states its writer (participant or experimenter); a report of an adverse event is marked as such.
"""

from typing import ClassVar

from textual import on
from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.screen import ModalScreen
from textual.widgets import Button, Footer, TextArea

from protocols.wording.words import ENGLISH_WORDS, Words
from study.session.watching.requests import NoteAsked, RequestSource
from study.tui.dismiss_screen import dismiss_screen
from study.tui.screens.help import HelpScreen
from study.tui.screens.note_prompt import MAX_NOTE_CHARACTERS
from study.tui.translated_screen import TranslatedScreen
from study.tui.widgets.card import Card
from study.tui.widgets.choice_row import ChoiceRow
from study.tui.widgets.literal_text import LiteralText

WRITERS: tuple[RequestSource, ...] = ("participant", "experimenter")
"""Writers among whom the dialog lets the user choose, in this order."""


class NoteScreen(TranslatedScreen[NoteAsked | None], ModalScreen[NoteAsked | None]):
    """Fields for the text, its writer, and whether it reports an adverse event.

    Ctrl-S or the button writes the note, Esc cancels. Dismissed with the note (NoteAsked), or with None after Esc.
    adverse, writer: initial choices; a writer that is not in `WRITERS` selects none.
    """

    PAGE = "help_note"
    DEFAULT_CSS = """
    NoteScreen { align: center middle; }
    NoteScreen TextArea { height: 5; margin: 1 0; }
    NoteScreen Button { margin-top: 1; }
    NoteScreen #message { height: auto; min-height: 1; color: $text-warning; }
    """
    AUTO_FOCUS = "TextArea"
    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("ctrl+s", "save", "Write it", priority=True),
        Binding("escape", "leave", "Leave", key_display="Esc"),
        Binding("f1", "help", "Help"),
    ]

    def __init__(
        self, adverse: bool = False, writer: RequestSource = "participant", words: Words = ENGLISH_WORDS
    ) -> None:
        super().__init__(words)
        self._is_adverse = adverse
        self._writer = writer

    def compose(self) -> ComposeResult:
        words = self.words
        with Card(words["note_title_happened" if self._is_adverse else "note_title"]):
            yield LiteralText(words["note_happened" if self._is_adverse else "note_what"])
            yield TextArea(soft_wrap=True, tab_behavior="focus")
            yield LiteralText(words["note_who"])
            writers = tuple(words[f"note_{writer}"] for writer in WRITERS)
            yield ChoiceRow(writers, WRITERS.index(self._writer) if self._writer in WRITERS else None, id="who")
            yield LiteralText(words["note_adverse"])
            yield ChoiceRow((words["no"], words["yes"]), int(self._is_adverse), id="adverse")
            yield Button(words["note_button"], variant="primary", compact=True)
            yield LiteralText(id="message")
        yield Footer(show_command_palette=False)

    @on(ChoiceRow.Submitted)
    def _focus_next(self) -> None:
        """Move the focus to the next field when a row of choices is left."""
        self.focus_next()

    @on(Button.Pressed)
    def action_save(self) -> None:
        """Dismiss with the note, whose blanks and line breaks are reduced to single spaces; refuse an empty or too long
        text, and a note without a writer."""
        text = " ".join(self.query_one(TextArea).text.split())
        writer_index = self.query_one("#who", ChoiceRow).chosen
        if not text:
            self._refuse(self.words["note_empty"])
        elif len(text) > MAX_NOTE_CHARACTERS:
            self._refuse(self.words.fill("note_long", {"most": MAX_NOTE_CHARACTERS, "count": len(text)}))
        elif writer_index is None:
            self._refuse(self.words["note_no_writer"])
        else:
            dismiss_screen(
                self, NoteAsked(WRITERS[writer_index], text, self.query_one("#adverse", ChoiceRow).chosen == 1)
            )

    def action_leave(self) -> None:
        dismiss_screen(self, None)

    def action_help(self) -> None:
        self.app.push_screen(HelpScreen(self.HELP, self.words))

    def _refuse(self, sentence: str) -> None:
        message = self.query_one("#message", LiteralText)
        message.update(sentence)
        self.call_after_refresh(message.scroll_visible, animate=False)  # its height is known then
