"""Screen of the labelled demonstration before the trials, in which a participant feels each direction of motion.

The participant can play both directions at each vibration frequency, any number of times, with the labels shown, to
learn what the answers of the later trials mean. The screen returns one choice at a time; the session plays it.
"""

from typing import ClassVar

from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.containers import Horizontal
from textual.events import Key
from textual.message import Message
from textual.widgets import Footer

from protocols.wording.words import ENGLISH_WORDS, Words
from study.session.views.participant_views import DemoChoice, DemoDone, DemoMenu, PlayDemo
from study.tui.dismiss_screen import dismiss_screen
from study.tui.keys.answer_keys import DIGITS, AnswerKeys
from study.tui.translated_screen import TranslatedScreen
from study.tui.trial_words import describe_felt_directions
from study.tui.widgets.direction_panel import DirectionPanel
from study.tui.widgets.literal_text import LiteralText


class DemoScreen(TranslatedScreen[DemoChoice]):
    """Shows both directions at the selected vibration, and which of them were played already.

    Keys: 1 and 2 (or other answer keys) play a direction, the arrow keys, b and n select a slower or faster vibration,
    p pauses, Enter ends. Dismissed with PlayDemo or DemoDone.
    """

    PAGE = "help_demo"
    DEFAULT_CSS = """
    DemoScreen #title { height: auto; min-height: 1; margin: 1 1 0 1; text-align: center; text-style: bold; }
    DemoScreen #steps { height: 1; margin: 0 1; text-align: center; }
    DemoScreen #answers { height: 1fr; margin: 0 1; }
    DemoScreen #message { height: auto; min-height: 1; margin: 0 1; text-align: center; text-style: bold; }
    DemoScreen #note { height: 2; margin: 0 1; text-align: center; color: $text-warning; }
    """
    AUTO_FOCUS = ""
    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("1", "heard(1)", "Feel 1"),
        Binding("2", "heard(2)", "Feel 2"),
        Binding("left,b", "turn(-1)", "Slower", key_display="←"),
        Binding("right,n", "turn(1)", "Faster", key_display="→"),
        Binding("p", "pause", "Pause"),
        Binding("enter", "done", "Done", key_display="Enter"),
    ]

    class PauseWanted(Message):
        """Posted when p is pressed: a pause is no `DemoChoice`, so the screen cannot return it."""

    def __init__(self, menu: DemoMenu, keys: AnswerKeys = DIGITS, words: Words = ENGLISH_WORDS) -> None:
        super().__init__(words)
        self._menu = menu
        self._keys = keys
        self._vibration = menu.vibration
        # Whether Enter was pressed before all stimuli were played, so that the next Enter ends.
        self._has_asked_to_confirm = False

    def compose(self) -> ComposeResult:
        yield LiteralText(id="title")
        yield LiteralText(id="steps")
        with Horizontal(id="answers"):
            yield DirectionPanel(1, self._menu.picture, self.words)
            yield DirectionPanel(2, self._menu.picture, self.words)
        yield LiteralText(id="message")
        yield LiteralText("" if self._menu.handle_moves else self.words["simulation"], id="note")
        yield Footer(show_command_palette=False)

    def on_mount(self) -> None:
        self._redraw(self.words.fill("demo_how", {"keys": self._keys.describe_keys(self.words)}))

    def on_key(self, event: Key) -> None:
        """Dismiss with the direction to play if an answer key was pressed."""
        answer = self._keys.parse_answer(event.character or event.key)
        if answer is not None:
            event.stop()
            dismiss_screen(self, PlayDemo(self._vibration, answer))

    def action_heard(self, answer: int) -> None:
        """Do nothing: the binding exists for its entry in the footer; `on_key` handles the answers."""

    def action_turn(self, step: int) -> None:
        """Select the next slower (-1) or faster (1) vibration; at the end of the range, only show a message."""
        vibration = self._vibration + step
        if vibration < 1:
            self._redraw(self.words["demo_slowest"])
        elif vibration > self._menu.vibrations:
            self._redraw(self.words["demo_fastest"])
        else:
            self._vibration = vibration
            self._redraw(describe_felt_directions(self._menu, self._vibration, self.words))

    def action_pause(self) -> None:
        self.post_message(self.PauseWanted())

    def action_done(self) -> None:
        """End the demonstration. If a stimulus was not played yet, Enter must be pressed twice, because it is often
        pressed by habit."""
        unfelt_count = 2 * self._menu.vibrations - len(set(self._menu.played_pairs))
        if unfelt_count and not self._has_asked_to_confirm:
            self._has_asked_to_confirm = True
            self._redraw(self.words.fill("demo_unfelt", {"unfelt": unfelt_count, "all": 2 * self._menu.vibrations}))
            return
        dismiss_screen(self, DemoDone())

    def _redraw(self, sentence: str) -> None:
        """Redraw title, steps and panels for the selected vibration, with a sentence below."""
        menu = self._menu
        self.query_one("#title", LiteralText).update(
            self.words.fill("demo_title", {"vibration": self._vibration, "vibrations": menu.vibrations})
        )
        self.query_one("#steps", LiteralText).update(
            "  ".join(self._format_step(vibration_index + 1) for vibration_index in range(menu.vibrations))
        )
        for panel in self.query(DirectionPanel):
            panel.mark = "felt" if (self._vibration, panel.number) in menu.played_pairs else ""
        self.query_one("#message", LiteralText).update(sentence)

    def _format_step(self, vibration: int) -> str:
        """Format a vibration for the row of steps: its number and, for each direction, whether it was played (✓); in
        brackets if it is selected."""
        marks = "".join("✓" if (vibration, number) in self._menu.played_pairs else "·" for number in (1, 2))
        return f"[{vibration} {marks}]" if vibration == self._vibration else f" {vibration} {marks} "
