"""An enforced rest: the remaining time, and what is left to do."""

import math
import time
from typing import ClassVar

from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.screen import Screen
from textual.widgets import Digits, Footer

from study.session.views.views import RestNotice
from study.tui.take_off import take_off
from study.tui.trial_words import progress_sentence, runs_left
from study.tui.widgets.card import Card
from study.tui.widgets.literal_text import LiteralText

TICK_S = 0.2
RESTING = "There is no hurry."
READY = "When you are ready, press Enter."


class RestScreen(Screen[float]):
    """Returns the seconds rested, never fewer than requested."""

    HELP = """\
# Rest

- Let go of the handle and relax your hand. Nothing is played.
- The rest is part of the study: a tired hand feels less. It cannot be shortened.
- When it is over, take as long as you like, and press **Enter** to go on.
- **Ctrl+C** leaves; the session can be resumed.
"""
    DEFAULT_CSS = """
    RestScreen { align: center middle; }
    RestScreen Digits { width: 100%; text-align: center; text-style: bold; margin-top: 1; }
    RestScreen Card LiteralText { text-align: center; width: 100%; }
    """
    BINDINGS: ClassVar[list[BindingType]] = [Binding("enter", "go_on", "Go on", key_display="Enter")]

    def __init__(self, notice: RestNotice) -> None:
        super().__init__()
        self._notice = notice
        self._began_s = time.monotonic()

    def compose(self) -> ComposeResult:
        notice = self._notice
        with Card("Rest"):
            yield LiteralText("Let go of the handle and relax your hand.", classes="strong")
            yield Digits()
            yield LiteralText(id="said", classes="gap strong")
            yield LiteralText(runs_left(notice.runs_left), classes="gap")
            if notice.progress is not None:
                yield LiteralText(progress_sentence(notice.progress))
        yield Footer(show_command_palette=False)

    def on_mount(self) -> None:
        self._began_s = time.monotonic()
        self._ticking = self.set_interval(TICK_S, self._tick)
        self._tick()

    def check_action(self, action: str, parameters: tuple[object, ...]) -> bool | None:
        # Until the rest is over Enter does nothing, so the footer does not name it.
        return action != "go_on" or self._over()

    def action_go_on(self) -> None:
        if self._over():
            take_off(self, self._seconds_rested())

    def _tick(self) -> None:
        left_s = max(0, math.ceil(self._notice.seconds - self._seconds_rested()))
        self.query_one(Digits).update(f"{left_s // 60}:{left_s % 60:02d}")
        self.query_one("#said", LiteralText).update(READY if self._over() else RESTING)
        if self._over():
            self._ticking.stop()
            self.refresh_bindings()

    def _seconds_rested(self) -> float:
        return time.monotonic() - self._began_s

    def _over(self) -> bool:
        return self._seconds_rested() >= self._notice.seconds
