"""UTF-8 text files with actionable errors."""

from pathlib import Path

from study.regular_file import TABLE_BYTES, read_regular
from study.store.disk.atomic_write import write_atomically
from study.store.disk.file_errors import CannotReadError


def read_text(path: Path, most_bytes: int = TABLE_BYTES) -> str:
    """The text without a byte order mark. Raises CannotReadError, also for a larger file."""
    try:
        return read_regular(path, most_bytes).decode("utf-8-sig")
    except (OSError, UnicodeDecodeError) as problem:
        raise CannotReadError(path, problem) from problem


def write_text(path: Path, text: str, *, overwrite: bool = False) -> None:
    """Write atomically. Line ends are written unchanged, so that a file is the same on every system. Surrogates
    (from a file name that is not UTF-8) become question marks."""
    write_atomically(path, text.encode("utf-8", errors="replace"), overwrite=overwrite)
