"""Description of an entry of a file format, for the tables of docs/formats.md.

The modules of the formats with such a table (calibration, identified model, mechanical model, recording) list their
entries in a constant `LAYOUT` of `study.store.formats`; `study.workflows.files.format_docs` makes the tables from it.
"""

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Entry:
    """An entry of a file format: a dataset, an attribute, or a field of a table. All texts are Markdown."""

    name: str
    """Name in the file."""
    type_and_shape: str
    """Type of the values, and the shape of an array, as in "(n, m) float32 or float64"."""
    meaning: str
    """Meaning and unit."""
    required: bool = True
    """Whether the entry must be present in the file."""
