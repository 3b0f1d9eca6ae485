"""Confirmation before the experimenter's view opens on a screen that the participant may see.

The view shows levels and which answers were right; a participant who has seen these is no longer naive.
Therefore the session's name must be typed: a single key that is pressed by mistake does not open the view.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, ClassVar

from textual.app import App
from textual.binding import Binding, BindingType

from study.tui.screens.typed_confirmation import TypedConfirmation

VIEW_SHOWN_NOTE = (
    "The participant's screen showed the experimenter's view: levels, and which answers were right or wrong."
)
"""Note for the log if the screen of the participant shows the view."""


class ConfirmView(TypedConfirmation):
    """Asks the experimenter for the session's name."""

    HELP = """\
# The experimenter's view

- It shows the levels and which answers were right or wrong. A participant who has seen that is no naive observer.
- Turn the screen away, type the session's name, and press **Enter**. **Esc** goes back.
- Opened at the participant's own screen, it is noted in the session's log.
- In a second terminal no name is asked for: `hapteq watch SESSION`.
"""
    DEFAULT_CSS = "ConfirmView Card { border: round $warning; }"
    BINDINGS: ClassVar[list[BindingType]] = [Binding("escape", "leave", "Back", key_display="Esc")]

    def __init__(self, session: str) -> None:
        paragraphs = (
            "This view shows the levels and which answers were right or wrong.",
            "Participants: press Esc. Experimenter: turn the screen away from the participant.",
            f"To open it, type {session} and press Enter.",
        )
        super().__init__(
            session, "For the experimenter", paragraphs, lambda: f"That is not {session}. Nothing is opened."
        )


def confirm_view(app: App[Any], session: str, on_confirmed: Callable[[], object]) -> None:
    """Open the dialog, unless it is open. session: name to be typed. on_confirmed: called after the confirmation, not
    otherwise."""
    if isinstance(app.screen, ConfirmView):
        return

    def act_on_decision(confirmed: bool | None) -> None:
        if confirmed:
            on_confirmed()

    app.push_screen(ConfirmView(session), act_on_decision)
