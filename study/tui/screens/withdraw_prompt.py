"""Dialog that confirms a participant's withdrawal of consent before data are erased.

The participant's code must be typed, so that no single key erases data. The dialog itself erases nothing.
"""

from typing import ClassVar

from textual import on
from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.containers import Vertical
from textual.screen import ModalScreen
from textual.widgets import Footer, Input, Static

from study.tui.dismiss_screen import dismiss_screen
from study.tui.screens.help import HelpScreen

HELP = """\
# Withdrawal

A participant withdraws the consent. All sessions of this code in this data folder are erased for good: answers,
recordings, tables and figures, and the analysis of the folder, which was made from them too. A tombstone with the
session's name stays, so that the code is not given again.

Type the code and press Enter to erase. **Esc** leaves everything as it is.

In a terminal: `hapteq withdraw SESSION`.
"""
"""Help page of the dialog, in Markdown."""


class WithdrawPrompt(ModalScreen[bool]):
    """Dialog that asks for the participant's code. Enter returns True if the typed text without surrounding blanks is
    the code, and else shows a message; Esc returns False. subject: the participant's code."""

    HELP = HELP
    CSS = """
    WithdrawPrompt { align: center middle; }
    WithdrawPrompt > Vertical {
        width: 70; max-width: 95%; height: auto; border: round $error; padding: 1 2; background: $surface;
    }
    WithdrawPrompt Input { margin-top: 1; }
    WithdrawPrompt #message { height: auto; min-height: 1; color: $text-error; }
    """
    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("escape", "leave", "Keep everything", key_display="Esc"),
        Binding("f1", "help", "Help"),  # a modal screen does not receive the application's own bindings
    ]

    def __init__(self, subject: str) -> None:
        super().__init__()
        self._subject = subject

    def compose(self) -> ComposeResult:
        with Vertical() as panel:
            panel.border_title = f"{self._subject} withdraws"
            yield Static(
                f"All sessions of {self._subject} in this data folder are erased for good: answers, recordings, tables "
                f"and figures, and the folder's analysis, which was made from them too.\n\n"
                f"To erase, type the code {self._subject} and press Enter.",
                markup=False,
            )
            yield Input(compact=True, id="code")
            yield Static("", id="message", markup=False)
        yield Footer(show_command_palette=False)

    @on(Input.Submitted)
    def _check_input(self, event: Input.Submitted) -> None:
        if event.value.strip() == self._subject:
            dismiss_screen(self, True)
        else:
            self.query_one("#message", Static).update(f"That is not {self._subject}. Nothing was erased.")

    def action_help(self) -> None:
        self.app.push_screen(HelpScreen(HELP))

    def action_leave(self) -> None:
        dismiss_screen(self, False)
