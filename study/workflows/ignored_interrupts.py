"""Ignore Ctrl-C and signals to end for the time of a short write that an interruption must not cut off."""

import contextlib
import signal
import threading
from collections.abc import Iterator


@contextlib.contextmanager
def ignore_interrupts() -> Iterator[None]:
    """Context in which Ctrl-C and signals to end are ignored. Without effect outside the main thread, which alone
    receives them."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    numbers = [getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP") if hasattr(signal, name)]
    # Read before any is replaced: an interruption between two replacements must not leave one ignored for good.
    handlers = {number: signal.getsignal(number) for number in numbers}
    try:
        for number in numbers:
            signal.signal(number, signal.SIG_IGN)
        yield
    finally:
        for number, handler in handlers.items():
            signal.signal(number, handler or signal.SIG_DFL)  # None: a handler that is not Python's
