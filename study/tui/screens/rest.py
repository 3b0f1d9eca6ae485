"""Screen of an enforced rest between runs: the remaining time, the number of runs left and the progress of the session.

The rest cannot be shortened: Enter has no effect before its end.
"""

import math
import time
from typing import ClassVar

from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.widgets import Digits, Footer

from protocols.wording.words import ENGLISH_WORDS, Words
from study.session.views.views import RestNotice
from study.tui.dismiss_screen import dismiss_screen
from study.tui.translated_screen import TranslatedScreen
from study.tui.trial_words import progress_sentence
from study.tui.widgets.card import Card
from study.tui.widgets.literal_text import LiteralText

TICK_S = 0.2
"""Interval (s) at which the remaining time is redrawn."""


class RestScreen(TranslatedScreen[float]):
    """Counts the enforced rest down and says how many runs are left; Enter continues once it is over. Returns the
    seconds rested, never fewer than requested."""

    PAGE = "help_rest"
    DEFAULT_CSS = """
    RestScreen { align: center middle; }
    RestScreen Digits { width: 100%; text-align: center; text-style: bold; margin-top: 1; }
    RestScreen Card LiteralText { text-align: center; width: 100%; }
    """
    BINDINGS: ClassVar[list[BindingType]] = [Binding("enter", "go_on", "Go on", key_display="Enter")]

    def __init__(self, notice: RestNotice, words: Words = ENGLISH_WORDS) -> None:
        super().__init__(words)
        self._notice = notice
        self._began_s = time.monotonic()

    def compose(self) -> ComposeResult:
        notice, words = self._notice, self.words
        with Card(words["rest_title"]):
            yield LiteralText(words["rest_relax"], classes="strong")
            yield Digits()
            yield LiteralText(id="message", classes="gap strong")
            yield LiteralText(words.fill_count("runs_left", notice.runs_left), classes="gap")
            if notice.progress is not None:
                yield LiteralText(progress_sentence(notice.progress, words))
        yield Footer(show_command_palette=False)

    def on_mount(self) -> None:
        self._began_s = time.monotonic()
        self._ticking = self.set_interval(TICK_S, self._tick)
        self._tick()

    def check_action(self, action: str, parameters: tuple[object, ...]) -> bool | None:
        # Until the rest is over Enter does nothing, so the footer does not name it.
        return action != "go_on" or self._has_ended()

    def action_go_on(self) -> None:
        if self._has_ended():
            dismiss_screen(self, self._seconds_rested())

    def _tick(self) -> None:
        remaining_s = max(0, math.ceil(self._notice.seconds - self._seconds_rested()))
        self.query_one(Digits).update(f"{remaining_s // 60}:{remaining_s % 60:02d}")
        self.query_one("#message", LiteralText).update(
            self.words["rest_ready" if self._has_ended() else "rest_resting"]
        )
        if self._has_ended():
            self._ticking.stop()
            self.refresh_bindings()

    def _seconds_rested(self) -> float:
        return time.monotonic() - self._began_s

    def _has_ended(self) -> bool:
        return self._seconds_rested() >= self._notice.seconds
