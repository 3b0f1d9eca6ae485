"""Entries of our file formats; the tables of docs/formats.md are made from these."""

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Entry:
    """An entry of a file format: name, type and meaning."""

    name: str
    holds: str
    """Type and shape."""
    meaning: str
    required: bool = True
