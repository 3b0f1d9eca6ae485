"""Detect whether a process is writing a session's log, by the lock (flock) that the writer holds on the file.

`event_log` sets the lock. The operating system releases it when the process ends, so that a crashed program does not
count as a writer.
"""

from pathlib import Path

from study.regular_file import open_regular


def is_log_locked(log_path: Path) -> bool | None:
    """Whether a process holds the exclusive lock of the log; None where this cannot be determined: on a system or file
    system without flock, or for a log that is missing or unreadable. The test itself holds a shared lock for an
    instant, during which a new writer would be refused; therefore call it rarely."""
    try:
        import fcntl
    except ImportError:  # Windows
        return None
    try:
        with open_regular(log_path) as file:  # closing the file releases the lock
            fcntl.flock(file, fcntl.LOCK_SH | fcntl.LOCK_NB)
    except BlockingIOError:
        return True
    except OSError:
        return None
    return False
