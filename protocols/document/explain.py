"""List of all fields of a protocol: value, default, the reason for the default, and the allowed values.

The texts come from the JSON Schema of the protocol (`protocols.document.schema`), so that they are written only once,
in `protocols.definition`.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

from protocols.definition.recording_protocol import RecordingProtocol
from protocols.definition.study_protocol import StudyProtocol
from protocols.document.dumping import protocol_values
from protocols.document.schema import Node, Place, describe_allowed, find_node, protocol_schema, resolve_reference
from protocols.document.validation_messages import format_key_path

TomlValue = str | int | float | bool | list[Any] | dict[str, str]
"""Value of a field as TOML has it. A table of texts (key to text) counts as a single value."""


@dataclass(frozen=True, slots=True)
class ExplainedField:
    """A field of a protocol: its value, its default, what it means, and which values are allowed."""

    key: str
    """Dotted path; entries of lists of tables count from 1: `staircase.steps[2].step_db`."""
    value: TomlValue
    default: TomlValue | None
    """None where every protocol must state the value itself."""
    description: str
    """Meaning of the field, and the reason for its default."""
    allowed: str
    """Allowed values, in words."""


def explain(protocol: StudyProtocol | RecordingProtocol) -> tuple[ExplainedField, ...]:
    """All fields of a protocol, in the order of its values, with nested tables flattened to dotted keys."""
    root = protocol_schema(protocol.kind)
    return tuple(_explain_fields(root, protocol_values(protocol), ()))


def _explain_fields(root: Node, value: Any, place: Place) -> Iterator[ExplainedField]:
    """Fields of a value at its place: of a table key by key, of a list of tables entry by entry, else the value."""
    node = resolve_reference(root, find_node(root, place) or {})
    if isinstance(value, dict) and ("properties" in node or "oneOf" in node):
        # An entry of a mixed list: its kind picks the schema.
        tag = (value[node["discriminator"]["propertyName"]],) if "oneOf" in node else ()
        for key, item in value.items():
            yield from _explain_fields(root, item, (*place, *tag, key))
    elif isinstance(value, list) and value and isinstance(value[0], dict):
        for index, item in enumerate(value):
            yield from _explain_fields(root, item, (*place, index))
    else:
        yield ExplainedField(
            key=format_key_path(root, place),
            value=value,
            default=node.get("default"),
            description=node.get("description", ""),
            allowed=describe_allowed(root, node, str(place[-1])),
        )
