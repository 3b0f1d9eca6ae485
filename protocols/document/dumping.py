"""A protocol back to plain values and to TOML text, with every default written out."""

import json
from typing import Any

from protocols.definition.recording_protocol import RecordingProtocol
from protocols.definition.study_protocol import StudyProtocol
from protocols.document.schema import ADAPTERS


def protocol_values(protocol: StudyProtocol | RecordingProtocol) -> dict[str, Any]:
    """Plain values as JSON has them, defaults filled in; `loading.protocol_from_values` takes them back."""
    values: dict[str, Any] = ADAPTERS[protocol.kind].dump_python(protocol, mode="json")
    return values


def dump_protocol(protocol: StudyProtocol | RecordingProtocol) -> str:
    """TOML text; `loading.load_protocol` reads the same protocol from it."""
    return _table("", protocol_values(protocol)).lstrip("\n")


def _table(path: str, values: dict[str, Any], header: str = "") -> str:
    plain = {key: value for key, value in values.items() if not _holds_tables(value)}
    text = (f"\n{header}\n" if header else "") + "".join(f"{key} = {_value(value)}\n" for key, value in plain.items())
    for key, value in values.items():
        inner = f"{path}.{key}" if path else key
        if isinstance(value, dict):
            text += _table(inner, value, f"[{inner}]")
        elif _holds_tables(value):
            text += "".join(_table(inner, entry, f"[[{inner}]]") for entry in value)
    return text


def _holds_tables(value: Any) -> bool:
    return isinstance(value, dict) or (isinstance(value, list) and any(isinstance(entry, dict) for entry in value))


def _value(value: Any) -> str:
    match value:
        case bool():
            return str(value).lower()
        case str():
            # TOML's basic strings are JSON's, but for the delete character and escaped surrogates.
            return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")
        case list():
            return f"[{', '.join(_value(entry) for entry in value)}]"
        case _:
            return repr(value)
