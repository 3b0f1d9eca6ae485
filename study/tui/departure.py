"""End the application on a signal, or when its terminal has disappeared.

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

POLL_EVERY_S = 0.5
"""Interval at which the application checks whether its terminal still exists (s)."""
LAST_RESORT_S = 10.0
"""Time (s) after which the process exits without cleaning up, because writing to a closed terminal may block for ever.
Longer than the engine takes to end."""


def leave_with_the_terminal(app: App[Any], on_departure: Callable[[], None]) -> None:
    """Call `on_departure` in the event loop on SIGTERM, on SIGHUP, and when the terminal has disappeared without a
    signal. If the process still runs `LAST_RESORT_S` later, it exits with `ExitCode.INTERRUPTED`. Call from the event
    loop."""

    def depart() -> None:
        last_resort = threading.Timer(LAST_RESORT_S, os._exit, (ExitCode.INTERRUPTED,))
        last_resort.daemon = True
        last_resort.start()
        on_departure()

    if threading.current_thread() is threading.main_thread():
        for number in (signal.SIGTERM, signal.SIGHUP):
            asyncio.get_running_loop().add_signal_handler(number, depart)
    terminal = sys.__stdin__
    if not app.is_headless and terminal is not None and terminal.isatty():
        # At the end of its input, Textual's reading thread would otherwise loop for ever without waiting.
        app.set_interval(POLL_EVERY_S, lambda: None if os.isatty(terminal.fileno()) else depart())
