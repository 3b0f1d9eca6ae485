"""JSON Schema of protocol files, and the values that it allows at each place of a file, in words.

The schema is generated from the dataclasses of `protocols.definition`, which state key names, bounds, defaults and
reasons.
"""

from functools import cache
from typing import Any

from pydantic import TypeAdapter

from protocols.definition.recording_protocol import RecordingProtocol
from protocols.definition.study_protocol import StudyProtocol

Node = dict[str, Any]
"""A JSON Schema, or a part of one."""
ValuePath = tuple[str | int, ...]
"""Path from the top of a protocol to a value: key names and list indices, from 0."""

ADAPTERS: dict[str, TypeAdapter[Any]] = {
    "study": TypeAdapter(StudyProtocol),
    "recording": TypeAdapter(RecordingProtocol),
}
"""Pydantic adapter of each `kind` of protocol, which validates, serialises and describes it."""

UNIT_WORDS = {
    "n": "newtons",
    "db": "decibels",
    "s": "seconds",
    "hz": "hertz",
    "deg": "degrees",
    "n_s_per_m": "N s/m",
    "m": "metres",
    "m_per_s": "m/s",
    "mps2": "m/s²",
}
"""Unit in words, by the suffix of a key after an underscore; a suffix that is missing here gives no unit."""


@cache
def make_protocol_schema(kind: str) -> Node:
    """Make the JSON Schema of a kind of protocol, "study" or "recording". Raises KeyError for another kind."""
    return ADAPTERS[kind].json_schema()


def find_node(root: Node, path: ValuePath) -> Node | None:
    """Find the schema of the value at this path; None where the schema has no such path."""
    node: Node | None = root
    for path_entry in path:
        node = _find_child_node(root, node, path_entry) if node is not None else None
    return node


def list_keys(root: Node, node: Node) -> tuple[str, ...]:
    """List the keys of a table in the order of the dataclass's fields; empty for another value than a table."""
    return tuple(resolve_reference(root, node).get("properties", {}))


def resolve_reference(root: Node, node: Node) -> Node:
    """Replace the "$ref" of a node by the definition it refers to; other entries of the node take precedence over those
    of the definition. A node without "$ref" is returned unchanged."""
    if "$ref" not in node:
        return node
    definition: Node = root["$defs"][node["$ref"].rsplit("/", 1)[-1]]
    return {**definition, **{key: value for key, value in node.items() if key != "$ref"}}


def describe_allowed(root: Node, node: Node, key: str = "") -> str:
    """Describe the allowed values of a node in words. key: name of the value, whose suffix determines the unit of a
    number (`UNIT_WORDS`); empty: no unit."""
    node = resolve_reference(root, node)
    if "oneOf" in node:
        return (
            f"a table whose {node['discriminator']['propertyName']} is "
            f"{_describe_choices(node['discriminator']['mapping'])}"
        )
    if "enum" in node or "const" in node:
        return _describe_choices(node.get("enum", [node.get("const")]))
    match node.get("type"):
        case "number" | "integer":
            return _describe_number(node) + find_unit(key)
        case "boolean":
            return "true or false"
        case "string":
            return _describe_text(node)
        case "array":
            return _describe_list(root, node, key)
        case "object" if "properties" not in node:
            return "a table of texts in quotes"
        case _:
            return f"a table with the keys {', '.join(list_keys(root, node))}"


def find_unit(key: str) -> str:
    """Find the unit of a key in words, such as ", in newtons" for `start_n`, by the longest suffix of `UNIT_WORDS` that
    the key ends in; empty for a key without a unit."""
    for suffix, unit in sorted(UNIT_WORDS.items(), key=lambda item: -len(item[0])):
        if key.endswith(f"_{suffix}"):
            return f", in {unit}"
    return ""


def _find_child_node(root: Node, node: Node, path_entry: str | int) -> Node | None:
    """Find the schema of an entry of a list (`path_entry`: its index), of a key of a table, or of the member of a union
    that the discriminator's value `path_entry` selects; None where there is no such schema."""
    node = resolve_reference(root, node)
    if isinstance(path_entry, int):
        return node.get("items")
    if "oneOf" in node:
        reference = node["discriminator"]["mapping"].get(path_entry)
        return {"$ref": reference} if reference else None
    child: Node | None = node.get("properties", {}).get(path_entry)
    if child is None and isinstance(additional_properties := node.get("additionalProperties"), dict):
        return additional_properties
    return child


def _describe_choices(values: Any) -> str:
    """Describe a choice of texts, such as: "a", "b" or "c". values: at least one."""
    quoted_values = [f'"{value}"' for value in values]
    return quoted_values[0] if len(quoted_values) == 1 else f"{', '.join(quoted_values[:-1])} or {quoted_values[-1]}"


def _describe_number(node: Node) -> str:
    """Describe a number and its bounds, such as: a whole number from 1 up to 9."""
    number_kind = "a whole number" if node["type"] == "integer" else "a number"
    bounds = [
        f"{bound_word} {node[bound]:g}"
        for bound, bound_word in (("exclusiveMinimum", "above"), ("minimum", "from"), ("maximum", "up to"))
        if bound in node
    ]
    return " ".join([number_kind, *bounds])


def _describe_text(node: Node) -> str:
    """Describe a text: as a name where it has a pattern ("^[a-z][a-z0-9_]{0,N}$"), else by its length."""
    if "pattern" in node:
        max_further_characters = node["pattern"].partition("{0,")[2].partition("}")[0]
        return (
            f"text in quotes: a lower-case letter, then up to {max_further_characters} lower-case letters, digits and "
            "underscores"
        )
    min_length, max_length = node.get("minLength", 0), node.get("maxLength")
    return f"text in quotes, {min_length} to {max_length} characters long" if max_length else "text in quotes"


def _describe_list(root: Node, node: Node, key: str) -> str:
    """Describe a list: the number of its entries, and the values that each may have."""
    min_count, max_count = node.get("minItems", 0), node.get("maxItems")
    count_text = f"{min_count} to {max_count}" if max_count else f"{min_count} or more"
    return f"a list of {count_text} entries, each {describe_allowed(root, node['items'], key)}"
