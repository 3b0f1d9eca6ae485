"""End the application on SIGTERM or SIGHUP, and when its terminal has been closed without a signal.

Without a terminal, a participant can neither answer nor stop a stimulus, so that the device must not continue.
"""

import asyncio
import os
import signal
import sys
import threading
from collections.abc import Callable
from typing import Any

from textual.app import App

from study.errors import ExitCode

TERMINAL_POLL_INTERVAL_S = 0.5
"""Interval (s) at which the application checks whether its terminal is still open. Chosen."""
FORCED_EXIT_DELAY_S = 10.0
"""Time (s) after `on_exit` at which the process exits without cleaning up, because writing to a closed terminal may
block for ever. Chosen longer than the engine process takes to end."""


def install_exit_handlers(app: App[Any], on_exit: Callable[[], None]) -> None:
    """Have `on_exit` called in the event loop on SIGTERM, on SIGHUP, and at each check that finds the terminal closed.
    If the process still runs `FORCED_EXIT_DELAY_S` after a call, it exits with `ExitCode.INTERRUPTED`. Call from the
    event loop; signals are handled only in the main thread."""

    def begin_exit() -> None:
        """Start the timer of the forced exit, and call `on_exit`."""
        forced_exit = threading.Timer(FORCED_EXIT_DELAY_S, os._exit, (ExitCode.INTERRUPTED,))
        forced_exit.daemon = True
        forced_exit.start()
        on_exit()

    if threading.current_thread() is threading.main_thread():
        for signal_number in (signal.SIGTERM, signal.SIGHUP):
            asyncio.get_running_loop().add_signal_handler(signal_number, begin_exit)
    terminal = sys.__stdin__
    if not app.is_headless and terminal is not None and terminal.isatty():
        # A closed terminal is no error for Textual: its reading thread would loop without waiting.
        app.set_interval(TERMINAL_POLL_INTERVAL_S, lambda: None if os.isatty(terminal.fileno()) else begin_exit())
