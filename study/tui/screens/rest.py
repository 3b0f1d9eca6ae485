"""Screen of an enforced rest between runs or trials: remaining time, remaining runs, and progress of the session.

The participant cannot shorten the rest: Enter has no effect before its end.
"""

import math
import time
from typing import ClassVar

from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.widgets import Digits, Footer

from protocols.wording.words import ENGLISH_WORDS, Words
from study.session.views.participant_views import RestNotice
from study.tui.dismiss_screen import dismiss_screen
from study.tui.translated_screen import TranslatedScreen
from study.tui.trial_words import describe_progress
from study.tui.widgets.card import Card
from study.tui.widgets.literal_text import LiteralText

COUNTDOWN_INTERVAL_S = 0.2
"""Interval (s) between updates of the remaining time. Chosen: a fraction of the second that is displayed."""


class RestScreen(TranslatedScreen[float]):
    """Countdown of the enforced rest, with the number of remaining runs; Enter continues after its end. Returns the
    duration of the rest (s), at least the requested one."""

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
        self._started_s = time.monotonic()

    def compose(self) -> ComposeResult:
        notice, words = self._notice, self.words
        with Card(words["rest_title"]):
            yield LiteralText(words["rest_relax"], classes="strong")
            yield Digits()
            yield LiteralText(id="message", classes="gap strong")
            yield LiteralText(words.fill_count("runs_left", notice.runs_left), classes="gap")
            if notice.progress is not None:
                yield LiteralText(describe_progress(notice.progress, words))
        yield Footer(show_command_palette=False)

    def on_mount(self) -> None:
        self._started_s = time.monotonic()
        self._countdown_timer = self.set_interval(COUNTDOWN_INTERVAL_S, self._update_countdown)
        self._update_countdown()

    def check_action(self, action: str, parameters: tuple[object, ...]) -> bool | None:
        # The footer does not list Enter before the end of the rest.
        return action != "go_on" or self._has_ended()

    def action_go_on(self) -> None:
        if self._has_ended():
            dismiss_screen(self, self._measure_elapsed_s())

    def _update_countdown(self) -> None:
        """Draw the remaining time, rounded up to seconds; at the end of the rest, stop and enable Enter."""
        remaining_s = max(0, math.ceil(self._notice.seconds - self._measure_elapsed_s()))
        self.query_one(Digits).update(f"{remaining_s // 60}:{remaining_s % 60:02d}")
        self.query_one("#message", LiteralText).update(
            self.words["rest_ready" if self._has_ended() else "rest_resting"]
        )
        if self._has_ended():
            self._countdown_timer.stop()
            self.refresh_bindings()

    def _measure_elapsed_s(self) -> float:
        """Measure the time (s) since the screen was shown."""
        return time.monotonic() - self._started_s

    def _has_ended(self) -> bool:
        """Whether the requested duration of the rest is over."""
        return self._measure_elapsed_s() >= self._notice.seconds
