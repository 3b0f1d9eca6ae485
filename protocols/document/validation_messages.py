"""Translate pydantic's validation errors into messages for the author of a protocol file: key, problem, allowed values.

Keys are written as in the file, with list entries counted from 1. A misspelt key is reported once, with the known key
that was probably meant.
"""

from collections.abc import Sequence
from difflib import get_close_matches
from typing import Any

from protocols.definition.problem import InconsistentError, Problem
from protocols.document.schema import (
    UNIT_WORDS,
    Node,
    ValuePath,
    describe_allowed,
    find_node,
    list_keys,
    resolve_reference,
)

_MAX_COMPARED_LENGTH = 60
"""Number of leading characters of a text that are compared with known keys; chosen, because the comparison of long
texts is slow."""


def collect_problems(root: Node, errors: Sequence[Any]) -> tuple[Problem, ...]:
    """Collect the problems of a protocol, without repeated reports of one cause. root: schema of the protocol's kind;
    errors: from pydantic's ValidationError."""
    unknown_locations = [error["loc"] for error in errors if error["type"] == "unexpected_keyword_argument"]
    intended_keys = {
        (*location[:-1], find_nearest_key(str(location[-1]), _list_sibling_keys(root, location)))
        for location in unknown_locations
    }
    problems: list[Problem] = []
    for error in errors:
        # Pydantic reports a misspelt required key twice (as unknown and as missing), and a list with invalid entries
        # also as too short: the second report is dropped.
        is_misspelt_key = error["type"] == "missing" and error["loc"] in intended_keys
        has_invalid_entries = error["type"] == "too_short" and len(error["input"]) > 0
        if not is_misspelt_key and not has_invalid_entries:
            problems.extend(_translate_error(root, error))
    return tuple(problems)


def format_key_path(root: Node, location: ValuePath) -> str:
    """Format a location in the document as a key: ("staircase", "steps", 1, "step_db") becomes
    `staircase.steps[2].step_db`. The names that pydantic inserts for the kind of an entry are left out."""
    path = ""
    for depth, part in enumerate(location):
        node = find_node(root, location[:depth])
        if isinstance(part, int):
            path += f"[{part + 1}]"
        elif node is None or "oneOf" not in resolve_reference(root, node):
            path += f".{part}" if path else part
    return path


def find_nearest_key(key: str, known_keys: Sequence[str]) -> str | None:
    """Find the known key that was probably meant: first the same quantity with another unit, then a similar spelling;
    None if there is none."""
    suffixes = tuple(f"_{unit}" for unit in UNIT_WORDS)
    for candidate in known_keys:
        if candidate.endswith(suffixes) and candidate.rsplit("_", 1)[0] in (key, key.rsplit("_", 1)[0]):
            return candidate
    similar_keys = get_close_matches(key[:_MAX_COMPARED_LENGTH].lower(), known_keys, n=1)
    return similar_keys[0] if similar_keys else None


def describe_value(value: Any) -> str:
    """Describe a value for a message: numbers and dates as Python prints them, texts and truth values with their type,
    lists and tables by type only."""
    match value:
        case bool():
            return f"{str(value).lower()}, a truth value"
        case str():
            return f'"{value}", a text'
        case list():
            return "a list"
        case dict():
            return "a table"
        case _:
            return str(value)


def _translate_error(root: Node, error: Any) -> tuple[Problem, ...]:
    """Translate one error of pydantic into problems, several for an inconsistency of several keys."""
    location: ValuePath = error["loc"]
    if error["type"] == "json_invalid":  # nested too deeply
        return (Problem("The text", f"cannot be read: {error['msg']}", "numbers and nesting of ordinary size"),)
    key = format_key_path(root, location)
    if error["type"] == "unexpected_keyword_argument":
        return (_report_unknown_key(root, location),)
    if error["type"] == "value_error" and isinstance(error["ctx"]["error"], InconsistentError):
        return tuple(problem.prefix_key(key) for problem in error["ctx"]["error"].problems)
    if error["type"] in ("union_tag_not_found", "union_tag_invalid"):
        return (_report_wrong_entry_kind(root, location, error),)
    node = find_node(root, location)
    name = str(location[-1]) if isinstance(location[-1], str) else str(location[-2])
    return (Problem(key, _describe_problem(error), describe_allowed(root, node, name) if node else "something else"),)


def _describe_problem(error: Any) -> str:
    """Describe the problem of a value as the predicate of a sentence whose subject is the key."""
    value = error["input"]
    match error["type"]:
        case "missing":
            return "is missing"
        case "less_than_equal" | "less_than":
            return f"is {value}, which is too large"
        case "greater_than_equal" | "greater_than":
            return f"is {value}, which is too small"
        case "finite_number":
            return f"is {value}, not a finite number"
        case "literal_error" | "enum" | "string_pattern_mismatch" if isinstance(value, str):
            return f'is "{value}"'
        case "string_too_short" | "string_too_long":
            return f"has {len(value)} characters"
        case "too_short" | "too_long":
            return f"has {len(value)} entries"
        case _:
            return f"is {describe_value(value)}"


def _report_unknown_key(root: Node, location: ValuePath) -> Problem:
    """Report an unknown key, with the table in which it belongs or the known key that was probably meant."""
    key, known_keys = str(location[-1]), _list_sibling_keys(root, location)
    table = format_key_path(root, location[:-1])
    problem = f"is no key of {f'[{table}]' if table else 'a protocol'}"
    tables_with_key = _find_tables_with_key(root, key)
    if table and key in root["properties"]:
        problem += "; it belongs at the top of the file, before the first [table]"
    elif tables_with_key:
        problem += f"; it belongs in [{tables_with_key[0]}]"
    elif suggestion := find_nearest_key(key, known_keys):
        problem += f"; did you mean {suggestion}"
    return Problem(format_key_path(root, location), problem, ", ".join(known_keys))


def _report_wrong_entry_kind(root: Node, location: ValuePath, error: Any) -> Problem:
    """Report an entry of a mixed list whose kind is missing or unknown."""
    node = resolve_reference(root, find_node(root, location) or {})
    kind_key, choices = node["discriminator"]["propertyName"], node["discriminator"]["mapping"]
    given_kind = error["input"].get(kind_key)
    problem = "is missing" if given_kind is None else f'is "{given_kind}"'
    if isinstance(given_kind, str) and (
        suggestions := get_close_matches(given_kind[:_MAX_COMPARED_LENGTH], choices, n=1)
    ):
        problem += f'; did you mean "{suggestions[0]}"'
    return Problem(
        f"{format_key_path(root, location)}.{kind_key}", problem, " or ".join(f'"{choice}"' for choice in choices)
    )


def _list_sibling_keys(root: Node, location: ValuePath) -> tuple[str, ...]:
    """List the keys that the schema allows in the table that contains this location; empty for an unknown table."""
    table = find_node(root, location[:-1])
    return list_keys(root, table) if table else ()


def _find_tables_with_key(root: Node, key: str) -> list[str]:
    """Find the names of the top-level tables that have this key."""
    tables = {name: resolve_reference(root, node) for name, node in root["properties"].items()}
    return [name for name, table in tables.items() if key in table.get("properties", {})]
