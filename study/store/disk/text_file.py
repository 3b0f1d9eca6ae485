"""UTF-8 text files with actionable errors, and the text of TOML files, limited so that parsing takes ordinary time."""

import re
from pathlib import Path

from study.regular_file import TABLE_BYTES, read_regular
from study.store.disk.atomic_write import write_atomically
from study.store.disk.file_errors import CannotReadError, UnusableFileError


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


TOML_BYTES = 2**22
"""Largest TOML file; a mechanical model of 100 coordinates is a twentieth of it."""
DEEPEST_KEY = 32
"""Most parts of a dotted key."""
_PART = r"(?:[\w-]++|\"(?:[^\"\\\n]|\\.)*+\"?|'[^'\n]*+'?)"
"""A part of a dotted key: bare, or in quotes, closed or not."""
_PIECE = re.compile(
    r"#[^\n]*+"
    r'|"""(?:[^\\"]|\\.|"(?!""))*+(?:""")?'
    r"|'''(?:[^']|'(?!''))*+(?:''')?"
    rf"|(?P<key>{_PART}(?:[ \t]*+\.[ \t]*+{_PART})*+)",
    re.DOTALL,
)
"""Comments and multi-line texts, which are skipped, and possible keys. Each match begins where the previous one
ended, so that the search is linear."""


def read_toml_text(path: Path, kind: str) -> str:
    """The text of a TOML file whose parsing takes ordinary time. kind: what it should be, for messages. Raises
    CannotReadError, UnusableFileError."""
    text = read_text(path, TOML_BYTES)
    if problem := too_long_key(text):
        raise UnusableFileError(path, kind, (problem,))
    return text


def too_long_key(text: str) -> str:
    """Problem with a dotted key of too many parts, for which the parser takes quadratic time; empty if there is
    none."""
    for piece in _PIECE.finditer(text):
        key = piece["key"]
        if key and len(key) > 2 * DEEPEST_KEY and len(re.findall(_PART, key)) > DEEPEST_KEY:
            line = text.count("\n", 0, piece.start()) + 1
            return f"line {line} has a key of more than {DEEPEST_KEY} parts"
    return ""
