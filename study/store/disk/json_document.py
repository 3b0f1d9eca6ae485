"""Read and write the JSON documents of hapteq: objects with `format`, `version` and, for results, `provenance`.

Documents are written atomically; numbers are finite (`strict_json`).
"""

import json
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, TypeVar

from pydantic import TypeAdapter, ValidationError

from equalizer.signals.listed_problems import format_validation_problems
from study.regular_file import MAX_DOCUMENT_BYTES
from study.store.disk.file_errors import UnusableFileError, convert_problems
from study.store.disk.provenance import Provenance
from study.store.disk.strict_json import load_json
from study.store.disk.text_file import read_text, write_text

Content = TypeVar("Content")
"""Content of a document."""


def write_json(
    path: Path,
    format_name: str,
    version: int,
    payload: Mapping[str, Any],
    provenance: Provenance | None = None,
    *,
    overwrite: bool = False,
) -> None:
    """Write a document. payload: JSON values. Its keys "format" and "version" replace the arguments; its "provenance"
    is replaced by the argument, unless that is None.

    Raises ValueError for NaN and infinity, which JSON does not have (write null), AlreadyExistsError where the file
    exists unless `overwrite`, CannotWriteError where it cannot be written.
    """
    provenance_entry = {} if provenance is None else {"provenance": provenance.as_dict()}
    document = {"format": format_name, "version": version, **payload, **provenance_entry}
    try:
        text = json.dumps(document, indent=2, ensure_ascii=False, allow_nan=False)
    except ValueError as error:
        raise ValueError(f"{path.name} would hold a value that JSON does not have: {error}") from error
    write_text(path, text + "\n", overwrite=overwrite)


def read_json(path: Path, format_name: str, version: int) -> dict[str, Any]:
    """Read a document: its content without format and version, but with its provenance.

    Raises CannotReadError where the file cannot be read, UnusableFileError where it is no JSON object or has another
    format or version.
    """
    document = parse_json(path, read_text(path, MAX_DOCUMENT_BYTES), format_name)
    stored_format, stored_version = document.pop("format", None), document.pop("version", None)
    if stored_format != format_name:
        raise UnusableFileError(
            path, format_name, (f"its format is {_describe_value(stored_format)}, not '{format_name}'",)
        )
    if stored_version != version or isinstance(stored_version, bool):
        reason = f"its version is {_describe_value(stored_version)}; this program reads version {version}"
        raise UnusableFileError(path, format_name, (reason,))
    return document


def read_content(
    path: Path, format_name: str, version: int, kind: str, parse: Callable[[dict[str, Any]], Content]
) -> Content:
    """Read the content of a document without its provenance, by `parse`, which raises ListedProblemsError for invalid
    content. kind: name of such files in messages. Raises as `read_json`, and UnusableFileError for invalid content."""
    document = read_json(path, format_name, version)
    document.pop("provenance", None)
    with convert_problems(path, kind):
        return parse(document)


def read_record(path: Path, format_name: str, version: int, kind: str, validator: TypeAdapter[Content]) -> Content:
    """Read a document whose content is a dataclass, by its validator. Keys of no field, such as the provenance, are
    ignored. kind: name of such files in messages. Raises as `read_json`, and UnusableFileError for a field that is
    missing or has a wrong type."""
    document = read_json(path, format_name, version)
    try:
        # As JSON, because lists become tuples there even where no other type is converted.
        return validator.validate_json(json.dumps(document), strict=True)
    except ValidationError as error:
        raise UnusableFileError(path, kind, format_validation_problems(error.errors())) from error


def parse_json(path: Path, text: str, kind: str) -> dict[str, Any]:
    """Parse text as a JSON object. path: of the file, for messages; kind: name of such files in messages. Raises
    UnusableFileError where it is no valid JSON (`load_json`) or no object."""
    try:
        document = load_json(text)
    except ValueError as error:
        raise UnusableFileError(path, kind, (f"this is not JSON: {error}",)) from error
    if not isinstance(document, dict):
        reason = f"it holds a {type(document).__name__}; a hapteq document is an object with format and version"
        raise UnusableFileError(path, kind, (reason,))
    return document


def _describe_value(value: Any) -> str:
    """Describe a value for a message; "missing" for None."""
    return "missing" if value is None else repr(value)
