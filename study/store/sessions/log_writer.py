"""Whether a log is being written right now, as the operating system knows it: its lock dies with its holder."""

from pathlib import Path

from study.store.disk.regular_file import open_regular


def is_log_locked(log: Path) -> bool | None:
    """None where this cannot be known (no such locks here, no such log).

    Looking takes the lock for some microseconds, in which a program that wants it is refused: look seldom.
    """
    try:
        import fcntl
    except ImportError:  # Windows
        return None
    try:
        with open_regular(log) as file:
            fcntl.flock(file, fcntl.LOCK_SH | fcntl.LOCK_NB)
    except BlockingIOError:
        return True
    except OSError:
        return None
    return False
