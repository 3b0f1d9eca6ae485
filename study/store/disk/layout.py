"""Description of an entry of a file format, for the tables of docs/formats.md, which
`study.workflows.files.format_docs` makes from the constants `LAYOUT` of `study.store.formats`."""

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Entry:
    """An entry of a file format, such as a dataset, an attribute or a key. The texts are Markdown."""

    name: str
    type_and_shape: str
    """Type of the values, and the shape of an array, as in "(n, m) float32 or float64"."""
    meaning: str
    """Meaning and unit."""
    required: bool = True
