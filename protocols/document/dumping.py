"""Serialisation of a protocol to plain values and to TOML text; the inverse is `loading`.

Every default is written out, so that the text states all settings.
"""

import json
from typing import Any

from protocols.definition.recording_protocol import RecordingProtocol
from protocols.definition.study_protocol import StudyProtocol
from protocols.document.schema import ADAPTERS


def protocol_to_values(protocol: StudyProtocol | RecordingProtocol) -> dict[str, Any]:
    """Convert a protocol to plain values (JSON types), all defaults included; inverse:
    `loading.protocol_from_values`."""
    values: dict[str, Any] = ADAPTERS[protocol.kind].dump_python(protocol, mode="json")
    return values


def dump_protocol(protocol: StudyProtocol | RecordingProtocol) -> str:
    """Convert a protocol to TOML text with all defaults; `loading.load_protocol` reads an equal protocol from it."""
    return _format_table("", protocol_to_values(protocol)).lstrip("\n")


def _format_table(path: str, values: dict[str, Any], header: str = "") -> str:
    """Format a table as TOML: its header, its plain keys, then its sub-tables, because TOML assigns each key to the
    header above it. path: dotted name of the table, empty for the document; header: empty for the document."""
    scalar_values = {key: value for key, value in values.items() if not _has_table_header(value)}
    text = (f"\n{header}\n" if header else "") + "".join(
        f"{key} = {_format_value(value)}\n" for key, value in scalar_values.items()
    )
    for key, value in values.items():
        table_path = f"{path}.{key}" if path else key
        if isinstance(value, dict):
            text += _format_table(table_path, value, f"[{table_path}]")
        elif _has_table_header(value):
            text += "".join(_format_table(table_path, entry, f"[[{table_path}]]") for entry in value)
    return text


def _has_table_header(value: Any) -> bool:
    """Whether a value is written under separate TOML headers: a table, or a list that contains a table."""
    return isinstance(value, dict) or (isinstance(value, list) and any(isinstance(entry, dict) for entry in value))


def _format_value(value: Any) -> str:
    """Format a truth value, text, number, or list of these as TOML."""
    match value:
        case bool():
            return str(value).lower()
        case str():
            return format_toml_text(value)
        case list():
            return f"[{', '.join(_format_value(entry) for entry in value)}]"
        case _:
            return repr(value)


def format_toml_text(text: str) -> str:
    """Format a text as TOML: its basic strings are JSON's, except that TOML forbids a bare delete character and escaped
    surrogates."""
    return json.dumps(text, ensure_ascii=False).replace("\x7f", "\\u007f")
