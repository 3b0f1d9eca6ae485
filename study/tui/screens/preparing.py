"""Screen that is shown during a slow step, such as the preparation of the device: current step and elapsed time. It has
no progress bar, because the duration is unknown."""

import time
from collections.abc import Callable

from textual.app import ComposeResult
from textual.containers import Vertical
from textual.widgets import Footer, Static

from protocols.wording.words import ENGLISH_WORDS, Words
from study.tui.translated_screen import TranslatedScreen

UPDATE_INTERVAL_S = 0.5
"""Interval (s) at which the elapsed time is drawn. Chosen: half of its resolution, a second."""
PLACEHOLDER_TEXT = "…"


class PreparingScreen(TranslatedScreen[None]):
    """Shows the current step and the elapsed time. Without a sentence it shows only `PLACEHOLDER_TEXT`, because the
    participant's language is not known before the protocol was read."""

    PAGE = "help_preparing"
    CSS = """
    PreparingScreen { align: center middle; }
    PreparingScreen > Vertical {
        width: 70; max-width: 95%; height: auto; border: round $primary; padding: 1 2; background: $surface;
    }
    PreparingScreen #elapsed { margin-top: 1; color: $foreground 65%; }
    """

    def __init__(
        self, sentence: str, now_s: Callable[[], float] = time.monotonic, words: Words = ENGLISH_WORDS
    ) -> None:
        """sentence: the first step, or empty; now_s: a monotonic clock (s)."""
        super().__init__(words)
        self._sentence = sentence
        self._now_s = now_s
        self._start_s = now_s()

    def compose(self) -> ComposeResult:
        with Vertical() as box:
            box.border_title = self._sentence and self.words["preparing_title"]
            yield Static(self._sentence or PLACEHOLDER_TEXT, id="sentence", markup=False)
            yield Static(self._describe_wait(), id="elapsed", markup=False)
        footer = Footer(show_command_palette=False)
        footer.display = bool(self._sentence)
        yield footer

    def on_mount(self) -> None:
        self.set_interval(UPDATE_INTERVAL_S, self._update_elapsed)

    def show_step(self, sentence: str, is_new_wait: bool = False) -> None:
        """Show the current step, a sentence. is_new_wait: whether another wait begins, so that the elapsed time
        restarts."""
        self._sentence = sentence
        if is_new_wait:
            self._start_s = self._now_s()
        if self.query("#sentence"):
            self.query_one("#sentence", Static).update(sentence)
            self.query_one(Footer).display = True
            self._set_box_title()

    def set_language(self, words: Words) -> None:
        self.words = words
        self._set_box_title()
        self.refresh_bindings()

    def _set_box_title(self) -> None:
        for box in self.query(Vertical):
            box.border_title = self._sentence and self.words["preparing_title"]

    def _update_elapsed(self) -> None:
        self.query_one("#elapsed", Static).update(self._describe_wait())

    def _describe_wait(self) -> str:
        """Describe the elapsed time of the present wait in words; empty without a sentence."""
        return describe_elapsed(self._now_s() - self._start_s, self.words) if self._sentence else ""


def describe_elapsed(elapsed_s: float, words: Words = ENGLISH_WORDS) -> str:
    """Describe an elapsed time (s) in words: minutes and seconds, or seconds alone below a minute."""
    minutes, remainder_s = divmod(int(elapsed_s), 60)
    return words.fill("elapsed_min" if minutes else "elapsed_s", {"minutes": minutes, "seconds": remainder_s})
