"""Compose docs/importing.md: how recordings of other programs are imported, and every key of an import map.

The prose is in `importing_text`; the tables of keys, functions and shipped maps come from the schema and the functions
of the code that reads a map, so that page and code agree.
"""

from collections.abc import Iterable

from protocols.document.schema import Node, resolve_reference
from study.importing.expressions.functions import FUNCTIONS
from study.importing.map_format.map_toml import MAP_SCHEMA, describe_allowed_in_map
from study.importing.map_library import list_shipped_maps, read_map
from study.workflows.files import importing_text


def compose_importing_page() -> str:
    """Compose the text of the page, in Markdown."""
    sections = [
        importing_text.INTRODUCTION,
        f"```toml\n{importing_text.EXAMPLE}```",
        "## Expressions",
        *importing_text.EXPRESSIONS,
        format_markdown_table(
            ("function", "gives"), ((f"`{function.usage}`", function.meaning) for function in FUNCTIONS.values())
        ),
        "## What is not read",
        importing_text.NOT_READ,
        "## Keys of a map",
        _format_key_section("At the top", MAP_SCHEMA),
        *(
            _format_key_section(_format_table_title(name, node), table)
            for name, node in MAP_SCHEMA["properties"].items()
            if (table := _resolve_table(node))
        ),
        "## Maps that come with hapteq",
        importing_text.SHIPPED_MAPS,
        format_markdown_table(("name", "files", "what"), (_format_map_row(name) for name in list_shipped_maps())),
    ]
    return "\n\n".join(sections) + "\n"


def _resolve_table(node: Node) -> Node:
    """Resolve the JSON schema of a TOML table, or of the entries of a list of tables, with references followed; empty
    for a plain value."""
    resolved_node = resolve_reference(MAP_SCHEMA, node)
    entry_schema = (
        resolve_reference(MAP_SCHEMA, resolved_node["items"]) if resolved_node.get("type") == "array" else resolved_node
    )
    return entry_schema if "properties" in entry_schema else {}


def _format_table_title(name: str, node: Node) -> str:
    """Format the header of a table as it is written in TOML, in backticks: `[[name]]` for a list of tables, else
    `[name]`."""
    return f"`[[{name}]]`" if resolve_reference(MAP_SCHEMA, node).get("type") == "array" else f"`[{name}]`"


def _format_key_section(title: str, table: Node) -> str:
    """Format the section on the keys of a table: heading and Markdown table of key, allowed values and meaning. Of the
    whole map (`MAP_SCHEMA`) only keys with plain values are listed, because its tables have sections."""
    plain_keys = [
        (key, node) for key, node in table["properties"].items() if table is not MAP_SCHEMA or not _resolve_table(node)
    ]
    required_keys = table.get("required", ())
    rows = (
        (
            f"`{key}`{' (needed)' if key in required_keys else ''}",
            describe_allowed_in_map(node, key),
            node.get("description", ""),
        )
        for key, node in plain_keys
    )
    return f"### {title}\n\n{format_markdown_table(('key', 'holds', 'meaning'), rows)}"


def _format_map_row(name: str) -> tuple[str, str, str]:
    """Format a row of the table of shipped maps: name, file patterns and title."""
    import_map = read_map(name).map
    return f"`{name}`", ", ".join(f"`{pattern}`" for pattern in import_map.files), import_map.title


def format_markdown_table(header: tuple[str, ...], rows: Iterable[tuple[str, ...]]) -> str:
    """Format a Markdown table. A bar within a cell would end the cell; it is replaced by a slash."""
    rows_with_header = [header, tuple("---" for _ in header), *rows]
    return "\n".join(f"| {' | '.join(cell.replace('|', '/') for cell in cells)} |" for cells in rows_with_header)
