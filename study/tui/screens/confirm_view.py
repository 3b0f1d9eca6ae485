"""Confirmation before the experimenter's view opens on a screen that the participant may see.

The view shows levels and which answers were right; a participant who has seen these is no longer naive.
Therefore the session's name must be typed: a single key that is pressed by mistake does not open the view.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, ClassVar

from textual import on
from textual.app import App, ComposeResult
from textual.binding import Binding, BindingType
from textual.screen import ModalScreen
from textual.widgets import Footer, Input

from study.tui.dismiss_screen import dismiss_screen
from study.tui.screens.help import HelpScreen
from study.tui.widgets.card import Card
from study.tui.widgets.literal_text import LiteralText

VIEW_SHOWN_NOTE = (
    "The participant's screen showed the experimenter's view: levels, and which answers were right or wrong."
)
"""Note for the log if the screen of the participant shows the view."""


class ConfirmView(ModalScreen[bool]):
    """Dialog that asks for the session's name. Enter returns True if the typed text without surrounding spaces is the
    name, and else shows a message; Esc returns False."""

    HELP = """\
# The experimenter's view

- It shows the levels and which answers were right or wrong. A participant who has seen that is no naive observer.
- Turn the screen away, type the session's name, and press **Enter**. **Esc** goes back.
- Opened at the participant's own screen, it is noted in the session's log.
- In a second terminal no name is asked for: `hapteq watch SESSION`.
"""
    DEFAULT_CSS = """
    ConfirmView { align: center middle; }
    ConfirmView Card { border: round $warning; }
    ConfirmView Input { margin-top: 1; }
    ConfirmView #message { height: auto; min-height: 1; color: $text-error; }
    """
    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("escape", "leave", "Back", key_display="Esc"),
        Binding("f1", "help", "Help"),
    ]

    def __init__(self, session: str) -> None:
        super().__init__()
        self._session_name = session

    def compose(self) -> ComposeResult:
        with Card("For the experimenter"):
            yield LiteralText("This view shows the levels and which answers were right or wrong.")
            yield LiteralText(
                "Participants: press Esc. Experimenter: turn the screen away from the participant.", classes="gap"
            )
            yield LiteralText(f"To open it, type {self._session_name} and press Enter.", classes="gap strong")
            yield Input(compact=True)
            yield LiteralText(id="message")
        yield Footer(show_command_palette=False)

    @on(Input.Submitted)
    def _check_input(self, event: Input.Submitted) -> None:
        if event.value.strip() == self._session_name:
            dismiss_screen(self, True)
        else:
            self.query_one("#message", LiteralText).update(f"That is not {self._session_name}. Nothing is opened.")

    def action_help(self) -> None:
        self.app.push_screen(HelpScreen(self.HELP))

    def action_leave(self) -> None:
        dismiss_screen(self, False)


def confirm_view(app: App[Any], session: str, on_confirmed: Callable[[], object]) -> None:
    """Open the dialog, unless it is open. session: name to be typed. on_confirmed: called after the confirmation, not
    otherwise."""
    if isinstance(app.screen, ConfirmView):
        return

    def act_on_decision(confirmed: bool | None) -> None:
        if confirmed:
            on_confirmed()

    app.push_screen(ConfirmView(session), act_on_decision)
