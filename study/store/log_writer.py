"""Whether somebody writes a log right now, as the operating system knows it: its lock dies with its holder."""

import os
from pathlib import Path


def somebody_writes(log: Path) -> bool | None:
    """None where this cannot be known (no such locks here, no such log).

    Looking takes the lock for some microseconds, in which a program that wants it is refused: look seldom.
    """
    try:
        import fcntl
    except ImportError:  # Windows
        return None
    try:
        descriptor = os.open(log, os.O_RDONLY)
    except OSError:
        return None
    try:
        fcntl.flock(descriptor, fcntl.LOCK_SH | fcntl.LOCK_NB)
    except BlockingIOError:
        return True
    except OSError:
        return None
    finally:
        os.close(descriptor)
    return False
