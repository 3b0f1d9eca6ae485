"""Read and write UTF-8 text files; errors are StudyErrors that tell a person what to do.

TOML files are limited in size and in the depth of their keys before they are parsed: the parser's time grows with the
square of the number of parts of a dotted key, so that a small hostile file could block the program.
"""

import re
from pathlib import Path

from study.regular_file import TABLE_BYTES, read_regular
from study.store.disk.atomic_write import write_atomically
from study.store.disk.file_errors import CannotReadError, UnusableFileError


def read_text(path: Path, most_bytes: int = TABLE_BYTES) -> str:
    """The text of a file, without a byte order mark. Raises CannotReadError where the file cannot be read, is not
    UTF-8, or is larger than `most_bytes`."""
    try:
        return read_regular(path, most_bytes).decode("utf-8-sig")
    except (OSError, UnicodeDecodeError) as problem:
        raise CannotReadError(path, problem) from problem


def write_text(path: Path, text: str, *, overwrite: bool = False) -> None:
    """Write atomically. Line ends are written unchanged, so that a file is the same on every system. Surrogates (from a
    file name that is not UTF-8) become question marks. Raises AlreadyThereError for an existing file unless
    `overwrite`, and CannotWriteError."""
    write_atomically(path, text.encode("utf-8", errors="replace"), overwrite=overwrite)


TOML_BYTES = 2**22
"""Largest TOML file that is read, in bytes; a mechanical model of 100 coordinates is a twentieth of that size."""
DEEPEST_KEY = 32
"""Largest number of parts of a dotted key."""
_PART = r"(?:[\w-]++|\"(?:[^\"\\\n]|\\.)*+\"?|'[^'\n]*+'?)"
"""Regular expression of a part of a dotted key: bare, or in quotes, which may lack their end. `++` and `*+` are
possessive, so that the search never backtracks."""
_TOML_TOKEN = re.compile(
    r"#[^\n]*+"
    r'|"""(?:[^\\"]|\\.|"(?!""))*+(?:""")?'
    r"|'''(?:[^']|'(?!''))*+(?:''')?"
    rf"|(?P<key>{_PART}(?:[ \t]*+\.[ \t]*+{_PART})*+)",
    re.DOTALL,
)
"""Regular expression of comments and multi-line strings, which are skipped, and of possible keys. Matches do not
overlap, so that the time of the search is linear in the length of the file."""


def read_toml_text(path: Path, kind: str) -> str:
    """The text of a TOML file, checked but not parsed. kind: what the file should be, for messages. Raises
    CannotReadError, and UnusableFileError for a key of too many parts."""
    text = read_text(path, TOML_BYTES)
    if problem := too_long_key(text):
        raise UnusableFileError(path, kind, (problem,))
    return text


def too_long_key(text: str) -> str:
    """A phrase that names the line of the first dotted key with more than `DEEPEST_KEY` parts; "" if there is none."""
    for token in _TOML_TOKEN.finditer(text):
        key = token["key"]
        if key and len(key) > 2 * DEEPEST_KEY and len(re.findall(_PART, key)) > DEEPEST_KEY:
            line = text.count("\n", 0, token.start()) + 1
            return f"line {line} has a key of more than {DEEPEST_KEY} parts"
    return ""
