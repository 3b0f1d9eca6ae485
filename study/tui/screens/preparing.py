"""While the device is prepared: current step and elapsed time. No bar, because the duration is unknown."""

import time
from collections.abc import Callable

from textual.app import ComposeResult
from textual.containers import Vertical
from textual.screen import Screen
from textual.widgets import Footer, Static

TICK_S = 0.5

HELP = """\
# Preparing

The program gets the device ready. Nothing moves, and there is nothing to do. The first time on a computer this
takes longer, because the simulated device is compiled.

**Ctrl+Q** leaves; a session that was begun can be resumed.
"""


class PreparingScreen(Screen[None]):
    HELP = HELP
    CSS = """
    PreparingScreen { align: center middle; }
    PreparingScreen > Vertical {
        width: 70; max-width: 95%; height: auto; border: round $primary; padding: 1 2; background: $surface;
    }
    PreparingScreen #elapsed { margin-top: 1; color: $foreground 65%; }
    """

    def __init__(self, sentence: str, now_s: Callable[[], float] = time.monotonic) -> None:
        super().__init__()
        self._sentence = sentence
        self._now_s = now_s
        self._began_s = now_s()

    def compose(self) -> ComposeResult:
        with Vertical() as box:
            box.border_title = "One moment"
            yield Static(self._sentence, id="sentence", markup=False)
            yield Static(elapsed_words(0.0), id="elapsed", markup=False)
        yield Footer(show_command_palette=False)

    def on_mount(self) -> None:
        self.set_interval(TICK_S, self._tick)

    def say(self, sentence: str, afresh: bool = False) -> None:
        """Show the current step; afresh: another wait begins, so the time restarts."""
        self._sentence = sentence
        if afresh:
            self._began_s = self._now_s()
        if self.query("#sentence"):
            self.query_one("#sentence", Static).update(sentence)

    def _tick(self) -> None:
        self.query_one("#elapsed", Static).update(elapsed_words(self._now_s() - self._began_s))


def elapsed_words(seconds: float) -> str:
    """Elapsed time in words."""
    whole = int(seconds)
    return f"{whole} s so far" if whole < 60 else f"{whole // 60} min {whole % 60} s so far"
