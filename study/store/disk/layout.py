"""Description of an entry of a file format, from which the tables of docs/formats.md are made.

The module of each format lists its entries in a constant `LAYOUT`.
"""

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Entry:
    """An entry of a file format: name, type and meaning."""

    name: str
    holds: str
    """Type and shape."""
    meaning: str
    """Meaning and unit."""
    required: bool = True
    """Whether the entry must be present in the file."""
