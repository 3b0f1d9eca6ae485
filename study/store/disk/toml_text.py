"""Text of TOML files, limited so that parsing takes ordinary time."""

import re
from pathlib import Path

from study.store.disk.file_errors import UnusableFileError
from study.store.disk.text_file import read_text

TOML_BYTES = 2**22
"""Largest file; a mechanical model of 100 coordinates is a twentieth of it."""
DEEPEST_KEY = 32
_PART = r"(?:[\w-]++|\"(?:[^\"\\\n]|\\.)*+\"?|'[^'\n]*+'?)"
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
    """kind: what it should be, for messages. Raises CannotReadError, UnusableFileError."""
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
