"""Content of a file, read and parsed once, in the forms that the recognisers of `hapteq validate` need.

A file is a folder, an HDF5 file (only its format attribute is read here), or text, which is also parsed as JSON and as
TOML. Text above a size limit is not parsed.
"""

import csv
import io
import tomllib
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from study.regular_file import MAX_DOCUMENT_BYTES
from study.store.disk.file_errors import CannotReadError, UnusableFileError
from study.store.disk.hdf5_file import is_hdf5, read_format
from study.store.disk.strict_json import load_json
from study.store.disk.text_file import MAX_TOML_BYTES, find_long_key, read_text


@dataclass(frozen=True, slots=True)
class FileContent:
    """Content of a file; None in each field of a form in which it cannot be read."""

    path: Path
    is_folder: bool = False
    hdf5_format: str | None = None
    """Format attribute of an HDF5 file; empty if it has none."""
    text: str | None = None
    json: Any = None
    """The parsed document, if the whole text is one."""
    toml: dict[str, Any] | None = None
    """The parsed document, if the whole text is one."""

    @property
    def json_format(self) -> str | None:
        """The `format` entry of a JSON object; None for other files."""
        format_name = self.json.get("format") if isinstance(self.json, dict) else None
        return format_name if isinstance(format_name, str) else None

    @property
    def header(self) -> tuple[str, ...]:
        """Fields of the first line as of a CSV table, without surrounding spaces; empty without text, or where the line
        cannot be parsed as CSV."""
        rows = csv.reader(io.StringIO((self.text or "").partition("\n")[0]))
        try:
            return tuple(name.strip() for name in next(rows, []))
        except csv.Error:
            return ()


def read_file_content(path: Path) -> FileContent:
    """Read the content of a file or folder. Raises CannotReadError where it cannot be read, UnusableFileError where it
    is unusable HDF5 (`read_format`), or its name ends in .h5 or .hdf5 and it is no HDF5."""
    try:
        if path.is_dir():
            return FileContent(path, is_folder=True)
        if is_hdf5(path):
            return FileContent(path, hdf5_format=read_format(path))
    except OSError as error:
        raise CannotReadError(path, error) from error
    if path.is_file() and path.suffix.lower() in (".h5", ".hdf5"):
        raise UnusableFileError(path, "HDF5 file", ("it does not begin as HDF5 files do",))
    text = read_text(path)
    return FileContent(path, text=text, json=_parse_json(text), toml=_parse_toml(text))


def _parse_json(text: str) -> Any:
    """Parse a JSON document; None if the text has more than `MAX_DOCUMENT_BYTES` characters (at least as many bytes) or
    is not JSON."""
    try:
        return load_json(text) if len(text) <= MAX_DOCUMENT_BYTES else None
    except ValueError:
        return None


def _parse_toml(text: str) -> dict[str, Any] | None:
    """Parse a TOML document; None if it is not TOML, has more than `MAX_TOML_BYTES` characters, or has a dotted key of
    too many parts (`find_long_key`), whose parsing would take minutes."""
    if len(text) > MAX_TOML_BYTES or find_long_key(text):
        return None
    try:
        return tomllib.loads(text)
    except (ValueError, RecursionError):
        return None
