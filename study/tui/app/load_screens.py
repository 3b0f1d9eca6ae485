"""Import further screens in a background thread, so that they open without delay but do not delay the first frame."""

import gc
import threading
from importlib import import_module

DEFERRED_MODULES = (
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
    """Start the import of `DEFERRED_MODULES` in a daemon thread, and return without waiting for it."""
    threading.Thread(target=_import_modules, name="load-screens", daemon=True).start()


def _import_modules() -> None:
    """Import `DEFERRED_MODULES`, then exclude all present objects from garbage collection."""
    for module_name in DEFERRED_MODULES:
        import_module(module_name)
    # Imported modules stay in use. Without freezing, each full garbage collection traversed their objects, which was
    # observed to delay the event loop by 50 ms.
    gc.freeze()
