"""What a participant reads before the first trial."""

from typing import ClassVar

from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.containers import Horizontal
from textual.screen import Screen
from textual.widgets import Footer

from study.session.views.counted import answers_are
from study.session.views.views import Welcome
from study.tui.keys.answer_keys import DIGITS, AnswerKeys
from study.tui.take_off import take_off
from study.tui.trial_words import plan
from study.tui.widgets.card import Sheet
from study.tui.widgets.direction_panel import DirectionPanel
from study.tui.widgets.literal_text import LiteralText


class InstructionsScreen(Screen[None]):
    HELP = """\
# Instructions

- This page says what happens in a trial and how to answer. Arrow keys scroll it.
- **Enter** begins.
- Ask the experimenter if anything is unclear; nothing moves before you go on.
- **Ctrl+C** leaves.
"""
    DEFAULT_CSS = """
    InstructionsScreen { align: center top; }
    InstructionsScreen #pictures { height: 1fr; min-height: 8; max-height: 18; }
    InstructionsScreen .practice { border-left: thick $warning; padding-left: 1; margin-top: 1; }
    """
    BINDINGS: ClassVar[list[BindingType]] = [Binding("enter", "begin", "Begin", key_display="Enter")]

    def __init__(self, welcome: Welcome, keys: AnswerKeys = DIGITS) -> None:
        super().__init__()
        self._welcome = welcome
        self._keys = keys

    def compose(self) -> ComposeResult:
        welcome = self._welcome
        with Sheet():
            yield LiteralText(welcome.title, classes="title")
            if welcome.resumed_after:
                yield LiteralText(_welcome_back(welcome.resumed_after))
            yield LiteralText("Hold the handle with a constant, comfortable grip. It shakes along 1 or 2:")
            with Horizontal(id="pictures"):
                yield DirectionPanel(1, welcome.picture)
                yield DirectionPanel(2, welcome.picture)
            yield LiteralText(_how(self._keys))
            yield LiteralText(plan(welcome))
            yield LiteralText(
                "You may stop at any time: let go of the handle, or press p for a pause, which takes the force off at "
                "once. Ctrl+C takes it off and leaves."
            )
            if not welcome.felt:
                yield LiteralText(
                    f"Practice: the device is a simulation ({welcome.device}), so nothing moves here. Your answers are "
                    "marked 'not felt' and never enter an analysis of people.",
                    classes="practice",
                )
            yield LiteralText("Press Enter to begin.", classes="gap strong")
        yield Footer(show_command_palette=False)

    def action_begin(self) -> None:
        take_off(self, None)


def _welcome_back(answers: int) -> str:
    return f"Welcome back: {answers_are(answers)} on the disk. The study goes on where it stopped."


def _how(keys: AnswerKeys) -> str:
    return (
        f"Feel as long as you like, then press {keys.choice}. Many trials are hard on purpose: if you cannot "
        "tell, guess. A guess can do no harm."
    )
