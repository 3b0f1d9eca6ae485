"""Screen that shows the progress of a running diagnosis, and lets the user stop it."""

import time
from collections.abc import Callable
from typing import ClassVar

from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.containers import Vertical
from textual.screen import Screen
from textual.widgets import Footer, ProgressBar, Static

from study.tui.dismiss_screen import dismiss_screen
from study.tui.screens.preparing import UPDATE_INTERVAL_S, describe_elapsed

HELP = """\
# Diagnosing

The recordings are compared with the model; its own parameters are re-tuned; each effect of the catalogue that the data
suggest is fitted, and compared with its rivals on data that no fit has seen.

**Esc** stops it. Nothing is written before the end, so nothing half done is left.
"""
"""Help of the screen, in Markdown."""


class DiagnosingScreen(Screen[bool]):
    """Current step, progress and elapsed time of a diagnosis. Esc closes the screen with the result True: the diagnosis
    is to be stopped. At the end of the diagnosis the screen is removed without a result."""

    HELP = HELP
    CSS = """
    DiagnosingScreen { align: center middle; }
    DiagnosingScreen > Vertical {
        width: 70; max-width: 95%; height: auto; border: round $primary; padding: 1 2; background: $surface;
    }
    DiagnosingScreen ProgressBar { margin-top: 1; }
    DiagnosingScreen Bar { width: 1fr; }
    DiagnosingScreen ProgressBar { width: 1fr; }
    DiagnosingScreen #elapsed { margin-top: 1; color: $foreground 65%; }
    """
    BINDINGS: ClassVar[list[BindingType]] = [Binding("escape", "stop", "Stop", key_display="Esc")]

    def __init__(self, step: str, now_s: Callable[[], float] = time.monotonic) -> None:
        """step: the first step, as a sentence; now_s: a monotonic clock (s)."""
        super().__init__()
        self._step = step
        self._now_s = now_s
        self._started_s = now_s()

    def compose(self) -> ComposeResult:
        with Vertical() as panel:
            panel.border_title = "Diagnosing"
            yield Static(self._step, id="what", markup=False)
            yield ProgressBar(total=1.0, show_eta=False)
            yield Static(describe_elapsed(0.0), id="elapsed", markup=False)
        yield Footer(show_command_palette=False)

    def on_mount(self) -> None:
        self.set_interval(UPDATE_INTERVAL_S, self._update_elapsed_time)

    def show_progress(self, step: str, share: float) -> None:
        """Show the current step and progress, if the screen is composed. step: sentence without capital letter and full
        stop; share: fraction of the work that is done, 0 to 1."""
        if self.query("#what"):
            self.query_one("#what", Static).update(f"{step[:1].upper()}{step[1:]}.")
            self.query_one(ProgressBar).update(progress=share)

    def action_stop(self) -> None:
        dismiss_screen(self, True)

    def _update_elapsed_time(self) -> None:
        self.query_one("#elapsed", Static).update(describe_elapsed(self._now_s() - self._started_s))
