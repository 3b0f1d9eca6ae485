"""Import further screens in a background thread, after the first frame is shown.

The first frame thus appears without their import time, and later screens open without a delay.
"""

import gc
import threading
from importlib import import_module

LATER_MODULES = (
    "study.tui.app.sitting_screens",
    "study.tui.screens.trial",
    "study.tui.screens.help",
    "textual.widgets._markdown",
    "study.tui.screens.session",
    "study.tui.app.app_commands",
    "study.tui.watch.watch_screen",
    "study.tui.engine.watch_feed",
)
"""Modules that the first frame does not need, in the order in which they are imported."""


def load_screens() -> None:
    """Start the import in a daemon thread, and return at once."""
    threading.Thread(target=_load, name="load-screens", daemon=True).start()


def _load() -> None:
    for name in LATER_MODULES:
        import_module(name)
    # Imported modules stay in use. Without freezing, the garbage collector searched their objects again and again,
    # which delayed the event loop by 50 ms now and then.
    gc.freeze()
