"""Read and write UTF-8 text files; errors are `StudyError`s with advice for the user.

TOML files are limited in size and in the number of parts of a dotted key before they are parsed: the parser's time
grows with the square of that number, so that a small hostile file could block the program.
"""

import re
from pathlib import Path

from study.regular_file import MAX_TABLE_BYTES, read_regular
from study.store.disk.atomic_write import write_atomically
from study.store.disk.file_errors import CannotReadError, UnusableFileError

MAX_TOML_BYTES = 2**22
"""Largest TOML file that is read (bytes). Chosen: 20 times the size of a mechanical model of 100 coordinates."""
MAX_KEY_PARTS = 32
"""Largest number of parts of a dotted key, as in `a.b.c` with three. Chosen; keys of hapteq's files have fewer."""
_KEY_PART = r"(?:[\w-]++|\"(?:[^\"\\\n]|\\.)*+\"?|'[^'\n]*+'?)"
"""Regular expression of a part of a dotted key: bare or quoted; the closing quote may be missing. `++` and `*+` are
possessive, so that the search never backtracks."""
_TOML_TOKEN = re.compile(
    r"#[^\n]*+"
    r'|"""(?:[^\\"]|\\.|"(?!""))*+(?:""")?'
    r"|'''(?:[^']|'(?!''))*+(?:''')?"
    rf"|(?P<key>{_KEY_PART}(?:[ \t]*+\.[ \t]*+{_KEY_PART})*+)",
    re.DOTALL,
)
"""Regular expression of comments and multi-line strings, which are skipped, and of possible keys. Matches do not
overlap, so that the time of the search is linear in the length of the file."""


def read_text(path: Path, max_bytes: int = MAX_TABLE_BYTES) -> str:
    """Read a text file, without its byte order mark. Line ends are unchanged. Raises CannotReadError where the file
    cannot be read, is not UTF-8, or is larger than `max_bytes`."""
    try:
        return read_regular(path, max_bytes).decode("utf-8-sig")
    except (OSError, UnicodeDecodeError) as problem:
        raise CannotReadError(path, problem) from problem


def write_text(path: Path, text: str, *, overwrite: bool = False) -> None:
    """Write a text file atomically. Line ends are written unchanged, so that a file is the same on every system.
    Surrogates (from a file name that is not UTF-8) become question marks. Raises AlreadyExistsError where the file
    exists unless `overwrite`, CannotWriteError where it cannot be written."""
    write_atomically(path, text.encode("utf-8", errors="replace"), overwrite=overwrite)


def read_toml_text(path: Path, kind: str) -> str:
    """Read the text of a TOML file, without parsing it. kind: name of such files in messages. Raises CannotReadError
    where the file cannot be read as text or exceeds `MAX_TOML_BYTES`, UnusableFileError where a dotted key has more
    than `MAX_KEY_PARTS` parts."""
    text = read_text(path, MAX_TOML_BYTES)
    if problem := find_long_key(text):
        raise UnusableFileError(path, kind, (problem,))
    return text


def find_long_key(text: str) -> str:
    """Find the first dotted key with more than `MAX_KEY_PARTS` parts: a sentence fragment with its line (from 1), or ""
    if there is none."""
    for token in _TOML_TOKEN.finditer(text):
        key = token["key"]
        # A key of n parts has at least n characters and n - 1 points: shorter keys need not be split.
        if key and len(key) > 2 * MAX_KEY_PARTS and len(re.findall(_KEY_PART, key)) > MAX_KEY_PARTS:
            line = text.count("\n", 0, token.start()) + 1
            return f"line {line} has a key of more than {MAX_KEY_PARTS} parts"
    return ""


def replace_invalid_bytes(name: str) -> str:
    """Make a file name valid text: bytes that are not UTF-8 (surrogates in Python) are replaced."""
    return name.encode(errors="replace").decode()
