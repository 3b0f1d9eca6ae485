"""Panel at the end: what happened, what was saved, and the possible next steps with their keys."""

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
"""Key of each next step, and its words."""


@dataclass(frozen=True, slots=True)
class Outcome:
    """Content of the panel: a title, paragraphs, and the possible next steps."""

    title: str
    parts: tuple[tuple[str, str], ...]
    """(heading, text); a heading may be empty."""
    decisions: tuple[Decision, ...]
    """Possible next steps, in this order."""
    grave: bool = True
    """False for good news."""
    words: Words = ENGLISH_WORDS
    """In which a participant is told what to do."""


class OutcomeScreen(TranslatedScreen[Decision], ModalScreen[Decision]):
    """Says what happened, what is saved and what to do; r, h, q and Enter choose the next step, as far as each is
    offered. Dismissed with that step."""

    HELP = HELP
    CSS = """
    OutcomeScreen { align: center middle; }
    OutcomeScreen > Vertical {
        width: 76; max-width: 95%; height: auto; max-height: 90%;
        border: heavy $error; padding: 1 2; background: $surface;
    }
    OutcomeScreen.-good > Vertical { border: round $primary; }
    OutcomeScreen VerticalScroll { height: auto; max-height: 16; }
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
        """Replace the content when more is known."""
        self._outcome, self.words = outcome, outcome.words
        if not self.query("#told"):
            return
        self.set_class(not outcome.grave, "-good")
        self.query_one(Vertical).border_title = f"{'! ' if outcome.grave else ''}{outcome.title}"
        self.query_one("#told", Static).update(_outcome_text(outcome))
        keys = [(key, self.words.translate_key(words)) for key, words in map(KEYS.__getitem__, outcome.decisions)]
        self.query_one("#offered", Static).update("\n".join(f"{key.capitalize():5}  {words}" for key, words in keys))
        self.refresh_bindings()

    def check_action(self, action: str, parameters: tuple[object, ...]) -> bool | None:
        return action != "decide" or parameters[0] in self._outcome.decisions

    def action_enter(self) -> None:
        for decision in ("look", "back"):
            if decision in self._outcome.decisions:
                self.action_decide(decision)
                return

    def action_decide(self, decision: Decision) -> None:
        dismiss_screen(self, decision)


def _outcome_text(outcome: Outcome) -> Content:
    parts = [Content.assemble((heading, "bold"), "\n" if heading else "", text) for heading, text in outcome.parts]
    return Content("\n\n").join(parts)
