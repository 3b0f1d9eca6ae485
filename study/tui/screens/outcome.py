"""Panel after a sitting, a stop or a failure: what happened, what was saved, and the next steps with their keys."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar, Literal

from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.containers import Vertical, VerticalScroll
from textual.content import Content
from textual.screen import ModalScreen
from textual.widgets import Footer, Static

from protocols.wording.words import ENGLISH_WORDS, Words
from study.tui.dismiss_screen import dismiss_screen
from study.tui.translated_screen import TranslatedScreen

Decision = Literal["resume", "look", "home", "quit", "back"]
"""Next step after a sitting or an error."""

HELP = """\
# How it ended

The box says what happened, what is safe on the disk, and what to do now. The keys in the last line do it.

Answers are written to the disk the moment they are given. A trial that was cut short is presented again when the
session is resumed. In a terminal: `hapteq resume SESSION`.
"""
"""Help of the panel, in Markdown."""

KEYS: dict[Decision, tuple[str, str]] = {
    "resume": ("r", "Resume the session"),
    "look": ("enter", "Look at the session"),
    "home": ("h", "Start screen"),
    "quit": ("q", "Leave hapteq"),
    "back": ("enter", "Back"),
}
"""Key of each next step (Textual's name), and its description."""


@dataclass(frozen=True, slots=True)
class Outcome:
    """Content of the panel: a title, paragraphs, and the possible next steps."""

    title: str
    paragraphs: tuple[tuple[str, str], ...]
    """(heading, text) of each paragraph; a heading may be empty."""
    decisions: tuple[Decision, ...]
    """Possible next steps, in this order."""
    is_problem: bool = True
    """Whether the panel reports a stop or a failure: red border, "!" before the title."""
    words: Words = ENGLISH_WORDS
    """Texts in the language of the panel."""


class OutcomeScreen(TranslatedScreen[Decision], ModalScreen[Decision]):
    """Shows what happened, what is saved and what to do; r, h, q and Enter choose the next step, if it is among
    `Outcome.decisions`. Dismissed with that step."""

    HELP = HELP
    CSS = """
    OutcomeScreen { align: center middle; }
    OutcomeScreen > Vertical {
        width: 76; max-width: 95%; height: auto; max-height: 90%;
        border: heavy $error; padding: 1 2; background: $surface;
    }
    OutcomeScreen.-good > Vertical { border: round $primary; }
    OutcomeScreen VerticalScroll { height: auto; max-height: 45vh; }
    OutcomeScreen #offered { margin-top: 1; }
    """
    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("r", "decide('resume')", "Resume"),
        Binding("enter", "enter", "Enter", show=False),
        Binding("h", "decide('home')", "Start screen"),
        Binding("q", "decide('quit')", "Leave"),
        Binding("f1,question_mark", "app.help", "Help", key_display="F1"),
    ]

    def __init__(self, outcome: Outcome) -> None:
        super().__init__(outcome.words)
        self._outcome = outcome

    def compose(self) -> ComposeResult:
        with Vertical():
            with VerticalScroll():
                yield Static(id="told")
            yield Static(id="offered", markup=False)
        yield Footer(show_command_palette=False)

    def on_mount(self) -> None:
        self.show_outcome(self._outcome)

    def show_outcome(self, outcome: Outcome) -> None:
        """Replace the content, for example when the engine does not answer a stop. May be called before the first
        frame."""
        self._outcome, self.words = outcome, outcome.words
        if not self.query("#told"):
            return
        self.set_class(not outcome.is_problem, "-good")
        self.query_one(Vertical).border_title = f"{'! ' if outcome.is_problem else ''}{outcome.title}"
        self.query_one("#told", Static).update(_format_outcome(outcome))
        keys = [(key, self.words.translate_key(key_text)) for key, key_text in map(KEYS.__getitem__, outcome.decisions)]
        self.query_one("#offered", Static).update(
            "\n".join(f"{key.capitalize():5}  {key_text}" for key, key_text in keys)
        )
        self.refresh_bindings()

    def check_action(self, action: str, parameters: tuple[object, ...]) -> bool | None:
        """Allow only the steps that the content offers; other actions are always allowed."""
        return action != "decide" or parameters[0] in self._outcome.decisions

    def action_enter(self) -> None:
        """Choose "look" if it is offered, otherwise "back"; no effect if neither is."""
        for decision in ("look", "back"):
            if decision in self._outcome.decisions:
                self.action_decide(decision)
                return

    def action_decide(self, decision: Decision) -> None:
        dismiss_screen(self, decision)


def _format_outcome(outcome: Outcome) -> Content:
    """Format the paragraphs, each with its heading in bold on its own line, separated by an empty line."""
    paragraphs = [
        Content.assemble((heading, "bold"), "\n" if heading else "", text) for heading, text in outcome.paragraphs
    ]
    return Content("\n\n").join(paragraphs)
