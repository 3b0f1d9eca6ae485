"""Import screens that are needed later in a thread after the first frame."""

import gc
import threading
from importlib import import_module

NEEDED_LATER = (
    "study.tui.app.sitting_screens",
    "study.tui.screens.trial",
    "study.tui.screens.help",
    "textual.widgets._markdown",
    "study.tui.screens.session",
    "study.tui.app.app_commands",
    "study.tui.watch.watch_screen",
    "study.tui.engine.watch_feed",
)
"""Modules that no first frame needs."""


def load_screens() -> None:
    """Returns at once."""
    threading.Thread(target=_load, name="load-screens", daemon=True).start()


def _load() -> None:
    for name in NEEDED_LATER:
        import_module(name)
    # What is loaded stays: searching all of it for garbage held the event loop up for 50 ms now and then.
    gc.freeze()
