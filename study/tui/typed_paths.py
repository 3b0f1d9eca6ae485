"""Paths that a person types into a field of a screen. No text raises an error: a path that the system refuses, such as
one that is too long, does not exist."""

import os
from pathlib import Path


def expand_home(text: str) -> Path:
    """Convert typed text to a path, with a home folder in place of `~`; unchanged where there is no such user."""
    return Path(os.path.expanduser(text))  # noqa: PTH111  Path.expanduser raises RuntimeError for an unknown user


def exists(path: Path) -> bool:
    """Whether there is a file or folder at this path."""
    return os.path.exists(path)  # noqa: PTH110  Path.exists raises OSError for a path that is too long


def is_file(path: Path) -> bool:
    """Whether there is a file at this path."""
    return os.path.isfile(path)  # noqa: PTH113  as in `exists`


def is_folder(path: Path) -> bool:
    """Whether there is a folder at this path."""
    return os.path.isdir(path)  # noqa: PTH112  as in `exists`
