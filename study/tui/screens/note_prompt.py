"""Prompt for a note of the experimenter for the session log, typed while the session continues."""

from collections.abc import Callable
from typing import ClassVar

from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.containers import Vertical
from textual.screen import ModalScreen
from textual.widgets import Input, Label

from study.tui.dismiss_screen import dismiss_screen

MAX_NOTE_CHARACTERS = 500
"""Maximum length of a note, in characters. Chosen: a few sentences, so that a line of the log stays readable."""


class NotePrompt(ModalScreen[str | None]):
    """Dialog with an input line at the bottom: Enter returns the text without surrounding blanks, Esc cancels, F8
    stops the session. Returns None if the text is empty or the entry was cancelled."""

    CSS = """
    NotePrompt { align: center bottom; }
    NotePrompt > Vertical {
        height: auto; max-width: 100; margin: 1 2; padding: 0 1; border: round $primary; background: $surface;
    }
    NotePrompt Input { border: none; height: 1; background: $boost; }
    """
    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("escape", "leave", "Leave"),
        Binding("f8", "stop", "STOP", priority=True),
    ]

    def __init__(self, adverse: bool, stop: Callable[[], None]) -> None:
        """adverse: whether the note reports an adverse event. stop: called for F8, to stop the session."""
        super().__init__()
        self._is_adverse = adverse
        self._stop = stop

    def compose(self) -> ComposeResult:
        with Vertical() as dialog:
            dialog.border_title = "Adverse event" if self._is_adverse else "Note"
            yield Label(
                "What happened to the participant (pain, numbness, a fright)?"
                if self._is_adverse
                else "What is to be noted? No names: the log is kept with the data."
            )
            yield Input(max_length=MAX_NOTE_CHARACTERS, placeholder="one sentence")
            yield Label("Enter writes it into the log, Escape leaves, F8 stops the session.")

    def on_input_submitted(self, event: Input.Submitted) -> None:
        dismiss_screen(self, event.value.strip() or None)

    def action_stop(self) -> None:
        self._stop()

    def action_leave(self) -> None:
        dismiss_screen(self, None)
