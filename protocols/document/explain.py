"""List of all fields of a protocol: value, default, the reason for the default, and the allowed values; shown by
`hapteq protocol`.

The texts come from the JSON Schema of the protocol (`protocols.document.schema`), so that they are written only once,
in `protocols.definition`.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

from protocols.definition.recording_protocol import RecordingProtocol
from protocols.definition.study_protocol import StudyProtocol
from protocols.document.dumping import protocol_to_values
from protocols.document.schema import (
    Node,
    ValuePath,
    describe_allowed,
    find_node,
    make_protocol_schema,
    resolve_reference,
)
from protocols.document.validation_messages import format_key_path

TomlValue = str | int | float | bool | list[Any] | dict[str, str]
"""Value of a field in TOML. A table of texts (key to text) counts as a single value."""


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


def explain_protocol(protocol: StudyProtocol | RecordingProtocol) -> tuple[ExplainedField, ...]:
    """Explain all fields of a protocol, in the order of its values, with nested tables flattened to dotted keys."""
    schema = make_protocol_schema(protocol.kind)
    return tuple(_explain_fields(schema, protocol_to_values(protocol), ()))


def _explain_fields(schema: Node, value: Any, path: ValuePath) -> Iterator[ExplainedField]:
    """Explain the value at a path: a table key by key, a list of tables entry by entry, other values as one field.
    schema: JSON Schema of the whole protocol. path: keys and list indices from the top of the protocol."""
    field_schema = resolve_reference(schema, find_node(schema, path) or {})
    if isinstance(value, dict) and ("properties" in field_schema or "oneOf" in field_schema):
        # An entry of a list of several kinds of tables: the value of its discriminator (`kind`) selects the schema.
        kind_key = (value[field_schema["discriminator"]["propertyName"]],) if "oneOf" in field_schema else ()
        for key, child_value in value.items():
            yield from _explain_fields(schema, child_value, (*path, *kind_key, key))
    elif isinstance(value, list) and value and isinstance(value[0], dict):
        for index, child_value in enumerate(value):
            yield from _explain_fields(schema, child_value, (*path, index))
    else:
        yield ExplainedField(
            key=format_key_path(schema, path),
            value=value,
            default=field_schema.get("default"),
            description=field_schema.get("description", ""),
            allowed=describe_allowed(schema, field_schema, str(path[-1])),
        )
