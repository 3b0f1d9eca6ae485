"""Writes docs/importing.md: how recordings of other programs are imported, and every key of an import map.

The prose is in `importing_text`. The tables of keys, functions and shipped maps come from the schema and the
functions of the code that reads a map, so that page and code agree.
"""

from collections.abc import Iterable

from protocols.document.schema import Node, resolve_reference
from study.importing.expressions.functions import FUNCTIONS
from study.importing.map_format.map_toml import MAP_SCHEMA, describe_allowed_in_map
from study.importing.map_library import list_shipped_maps, read_map
from study.workflows.files import importing_text


def write_importing_page() -> str:
    """The text of docs/importing.md, in Markdown."""
    parts = [
        importing_text.INTRODUCTION,
        f"```toml\n{importing_text.EXAMPLE}```",
        "## Expressions",
        *importing_text.EXPRESSIONS,
        _rows(("function", "gives"), ((f"`{f.usage}`", f.meaning) for f in FUNCTIONS.values())),
        "## What is not read",
        importing_text.NOT_READ,
        "## Keys of a map",
        _keys("At the top", MAP_SCHEMA),
        *(_keys(_title(name, node), _table_of(node)) for name, node in _tables()),
        "## Maps that come with hapteq",
        importing_text.SHIPPED_MAPS,
        _rows(("name", "files", "what"), (_map_row(name) for name in list_shipped_maps())),
    ]
    return "\n\n".join(parts) + "\n"


def _tables() -> list[tuple[str, Node]]:
    """Name and schema of each table of a map."""
    return [(name, node) for name, node in MAP_SCHEMA["properties"].items() if _table_of(node)]


def _table_of(node: Node) -> Node:
    """Schema of a table, or of the entries of a list of tables; empty for a plain value."""
    resolved = resolve_reference(MAP_SCHEMA, node)
    entries = resolve_reference(MAP_SCHEMA, resolved["items"]) if resolved.get("type") == "array" else resolved
    return entries if "properties" in entries else {}


def _title(name: str, node: Node) -> str:
    """Header of a table as it is written in TOML: `[[name]]` for a list of tables, else `[name]`."""
    return f"`[[{name}]]`" if resolve_reference(MAP_SCHEMA, node).get("type") == "array" else f"`[{name}]`"


def _keys(title: str, table: Node) -> str:
    """Section about the plain keys of a table, as a Markdown table."""
    plain_keys = [
        (key, node) for key, node in table["properties"].items() if table is not MAP_SCHEMA or not _table_of(node)
    ]
    required = table.get("required", ())
    rows = (
        (
            f"`{key}`{' (needed)' if key in required else ''}",
            describe_allowed_in_map(node, key),
            node.get("description", ""),
        )
        for key, node in plain_keys
    )
    return f"### {title}\n\n{_rows(('key', 'holds', 'meaning'), rows)}"


def _map_row(name: str) -> tuple[str, str, str]:
    """Name, file patterns and title of a shipped map."""
    import_map = read_map(name).map
    return f"`{name}`", ", ".join(f"`{pattern}`" for pattern in import_map.files), import_map.title


def _rows(heading: tuple[str, ...], rows: Iterable[tuple[str, ...]]) -> str:
    """A Markdown table. A bar within a cell would end it and is replaced by a slash."""
    lines = [heading, tuple("---" for _ in heading), *rows]
    return "\n".join(f"| {' | '.join(cell.replace('|', '/') for cell in line)} |" for line in lines)
