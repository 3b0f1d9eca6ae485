"""The text of TOML files, small enough to be parsed in ordinary time."""

import re
from pathlib import Path

from study.store.disk.file_errors import UnusableFileError
from study.store.disk.text_file import read_text

TOML_BYTES = 2**22
"""A mechanical model of 100 coordinates is a twentieth of it."""
DEEPEST_KEY = 32
_PART = r"(?:[\w-]++|\"(?:[^\"\\\n]|\\.)*+\"?|'[^'\n]*+'?)"
_PIECE = re.compile(
    r"#[^\n]*+"
    r'|"""(?:[^\\"]|\\.|"(?!""))*+(?:""")?'
    r"|'''(?:[^']|'(?!''))*+(?:''')?"
    rf"|(?P<key>{_PART}(?:[ \t]*+\.[ \t]*+{_PART})*+)",
    re.DOTALL,
)
"""Comments and texts of several lines, which are passed over, and what may be a key. Each begins where the one before
ended, so that the search takes no longer than the text is long."""


def read_toml_text(path: Path, kind: str) -> str:
    """kind: what it should be, for messages. Raises CannotReadError, UnusableFileError."""
    text = read_text(path, TOML_BYTES)
    if problem := too_long_key(text):
        raise UnusableFileError(path, kind, (problem,))
    return text


def too_long_key(text: str) -> str:
    """Empty where there is none. The parser takes n^2 steps for a key of n parts."""
    for piece in _PIECE.finditer(text):
        key = piece["key"]
        if key and len(key) > 2 * DEEPEST_KEY and len(re.findall(_PART, key)) > DEEPEST_KEY:
            line = text.count("\n", 0, piece.start()) + 1
            return f"line {line} has a key of more than {DEEPEST_KEY} parts"
    return ""
