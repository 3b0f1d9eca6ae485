"""Leave when asked from outside, or when the terminal is gone: the device must not run unattended."""

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
"""Interval at which the terminal is looked at (s)."""
LAST_RESORT_S = 10.0
"""Longer than the engine ever takes to end. Writing to a closed terminal may block forever."""


def leave_with_the_terminal(app: App[Any], leave: Callable[[], None]) -> None:
    """Call `leave` from the event loop on SIGTERM, on SIGHUP, and when the terminal vanished without a signal."""

    def depart() -> None:
        last_resort = threading.Timer(LAST_RESORT_S, os._exit, (ExitCode.INTERRUPTED,))
        last_resort.daemon = True
        last_resort.start()
        leave()

    if threading.current_thread() is threading.main_thread():
        for number in (signal.SIGTERM, signal.SIGHUP):
            asyncio.get_running_loop().add_signal_handler(number, depart)
    terminal = sys.__stdin__
    if not app.is_headless and terminal is not None and terminal.isatty():
        # Without this, Textual's reading thread would spin on the end of the input for ever.
        app.set_interval(POLL_EVERY_S, lambda: None if os.isatty(terminal.fileno()) else depart())
