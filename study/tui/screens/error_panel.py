"""What happened, what was saved, what to do now."""

from typing import ClassVar

from textual import on
from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.containers import Horizontal
from textual.screen import ModalScreen
from textual.widgets import Button, Footer

from study.tui.screens.help import HelpScreen
from study.tui.widgets.card import Card
from study.tui.widgets.said import Said


class ErrorPanel(ModalScreen[str]):
    """Returns the chosen one of `actions`; the first has the focus."""

    HELP = """\
# Something went wrong

- The panel says what happened, what is safe, and what to do now.
- **Left** and **Right** go from button to button, **Enter** presses it.
- **Esc** presses the first one.
"""
    DEFAULT_CSS = """
    ErrorPanel { align: center middle; }
    ErrorPanel Card { border: heavy $error; }
    ErrorPanel #actions { height: auto; margin-top: 1; }
    ErrorPanel Button { margin-right: 2; min-width: 0; padding: 0 2; background: $panel; }
    """
    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("left", "app.focus_previous", "Previous", show=False),
        Binding("right", "app.focus_next", "Next", show=False),
        Binding("escape", "first", "Close", key_display="Esc"),
        Binding("f1", "help", "Help"),
    ]

    def __init__(
        self, title: str, happened: str, saved: str, do_now: str, actions: tuple[str, ...] = ("Close",)
    ) -> None:
        super().__init__()
        self._title = title
        self._parts = (("What happened", happened), ("What is safe", saved), ("What to do now", do_now))
        self._actions = actions

    def compose(self) -> ComposeResult:
        with Card(self._title):
            told = [(name, text) for name, text in self._parts if text]
            for index, (name, text) in enumerate(told):
                yield Said(name, classes="strong gap" if index else "strong")
                yield Said(text)
            with Horizontal(id="actions"):
                for action in self._actions:
                    yield Button(action, compact=True)
        yield Footer(show_command_palette=False)

    @on(Button.Pressed)
    def _choose(self, pressed: Button.Pressed) -> None:
        self.dismiss(str(pressed.button.label))

    def action_first(self) -> None:
        self.dismiss(self._actions[0])

    def action_help(self) -> None:
        self.app.push_screen(HelpScreen(self.HELP))
