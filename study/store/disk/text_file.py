"""Text files as UTF-8, with errors that a person can act on."""

from pathlib import Path

from study.store.disk.atomic_write import write_atomically
from study.store.disk.file_errors import CannotReadError
from study.store.disk.regular_file import TABLE_BYTES, read_regular


def read_text(path: Path, most_bytes: int = TABLE_BYTES) -> str:
    """The text without a byte order mark. Raises CannotReadError, also for a file that is larger."""
    try:
        return read_regular(path, most_bytes).decode("utf-8-sig")
    except (OSError, UnicodeDecodeError) as problem:
        raise CannotReadError(path, problem) from problem


def write_text(path: Path, text: str, *, overwrite: bool = False) -> None:
    """Line ends are written as they are, so that a file is the same on every system. Half characters (of a file name
    that is not UTF-8, say) become question marks."""
    write_atomically(path, text.encode("utf-8", errors="replace"), overwrite=overwrite)
