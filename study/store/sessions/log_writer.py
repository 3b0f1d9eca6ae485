"""Whether a log is being written right now, by the operating system's lock, which ends with its holder."""

from pathlib import Path

from study.regular_file import open_regular


def is_log_locked(log: Path) -> bool | None:
    """Whether a process holds the log's lock; None if unknown (no such locks here, no such log). Probing holds the lock
    for some microseconds, in which a writer would be refused: probe rarely."""
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
