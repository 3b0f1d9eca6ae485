"""Translates pydantic's validation errors for the author of a protocol file: key, what is wrong, what is allowed.

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

_LONGEST_WORD = 60
"""Longest word (characters) that is compared with known keys: comparing longer ones would take minutes."""


def collect_problems(root: Node, errors: Sequence[Any]) -> tuple[Problem, ...]:
    """Problems of a protocol, each once. root: schema of the protocol's kind; errors: from pydantic's
    ValidationError."""
    unknown = [error["loc"] for error in errors if error["type"] == "unexpected_keyword_argument"]
    intended_keys = {
        (*place[:-1], find_nearest_key(str(place[-1]), _list_sibling_keys(root, place))) for place in unknown
    }
    problems: list[Problem] = []
    for error in errors:
        # Pydantic reports a misspelt required key twice (as unknown and as missing), and a list with invalid entries
        # also as too short: the second report is dropped.
        wrong_name = error["type"] == "missing" and error["loc"] in intended_keys
        wrong_entries = error["type"] == "too_short" and len(error["input"]) > 0
        if not wrong_name and not wrong_entries:
            problems.extend(_translate_error(root, error))
    return tuple(problems)


def format_key_path(root: Node, place: ValuePath) -> str:
    """`staircase.steps[2].step_db` from ("staircase", "steps", 1, "step_db"); list entries count from 1."""
    path = ""
    for depth, part in enumerate(place):
        node = find_node(root, place[:depth])
        if isinstance(part, int):
            path += f"[{part + 1}]"
        elif node is None or "oneOf" not in resolve_reference(root, node):
            path += f".{part}" if path else part
    return path


def find_nearest_key(key: str, known_keys: Sequence[str]) -> str | None:
    """The known key that was probably meant: first the same quantity with another unit, then a similar spelling;
    None if there is none."""
    suffixes = tuple(f"_{unit}" for unit in UNIT_WORDS)
    for candidate in known_keys:
        if candidate.endswith(suffixes) and candidate.rsplit("_", 1)[0] in (key, key.rsplit("_", 1)[0]):
            return candidate
    candidates = get_close_matches(key[:_LONGEST_WORD].lower(), known_keys, n=1)
    return candidates[0] if candidates else None


def describe_value(value: Any) -> str:
    """A value for a message: numbers and texts as in the file, other types by name."""
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
    """Problems for one error of pydantic: key in the file, text, allowed values."""
    place: ValuePath = error["loc"]
    if error["type"] == "json_invalid":  # nested too deeply
        return (Problem("The text", f"cannot be read: {error['msg']}", "numbers and nesting of ordinary size"),)
    key = format_key_path(root, place)
    if error["type"] == "unexpected_keyword_argument":
        return (_report_unknown_key(root, place),)
    if error["type"] == "value_error" and isinstance(error["ctx"]["error"], InconsistentError):
        return tuple(problem.prefix_key(key) for problem in error["ctx"]["error"].problems)
    if error["type"] in ("union_tag_not_found", "union_tag_invalid"):
        return (_report_wrong_entry_kind(root, place, error),)
    node = find_node(root, place)
    name = str(place[-1]) if isinstance(place[-1], str) else str(place[-2])
    return (Problem(key, _describe_problem(error), describe_allowed(root, node, name) if node else "something else"),)


def _describe_problem(error: Any) -> str:
    """What is wrong with the value, as the predicate of a sentence whose subject is the key."""
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


def _report_unknown_key(root: Node, place: ValuePath) -> Problem:
    """Problem for an unknown key, with the table in which it belongs or the known key that was probably meant."""
    key, known_keys = str(place[-1]), _list_sibling_keys(root, place)
    table = format_key_path(root, place[:-1])
    problem = f"is no key of {f'[{table}]' if table else 'a protocol'}"
    homes = _find_sections(root, key)
    if table and key in root["properties"]:
        problem += "; it belongs at the top of the file, before the first [table]"
    elif homes:
        problem += f"; it belongs in [{homes[0]}]"
    elif suggestion := find_nearest_key(key, known_keys):
        problem += f"; did you mean {suggestion}"
    return Problem(format_key_path(root, place), problem, ", ".join(known_keys))


def _report_wrong_entry_kind(root: Node, place: ValuePath, error: Any) -> Problem:
    """Problem for an entry of a mixed list whose kind is missing or unknown."""
    node = resolve_reference(root, find_node(root, place) or {})
    tag, choices = node["discriminator"]["propertyName"], node["discriminator"]["mapping"]
    given_kind = error["input"].get(tag)
    problem = "is missing" if given_kind is None else f'is "{given_kind}"'
    if isinstance(given_kind, str) and (suggestions := get_close_matches(given_kind[:_LONGEST_WORD], choices, n=1)):
        problem += f'; did you mean "{suggestions[0]}"'
    return Problem(f"{format_key_path(root, place)}.{tag}", problem, " or ".join(f'"{choice}"' for choice in choices))


def _list_sibling_keys(root: Node, place: ValuePath) -> tuple[str, ...]:
    """Keys that the schema allows in the table that contains this place."""
    table = find_node(root, place[:-1])
    return list_keys(root, table) if table else ()


def _find_sections(root: Node, key: str) -> list[str]:
    """Top-level tables that have this key."""
    sections = {name: resolve_reference(root, node) for name, node in root["properties"].items()}
    return [name for name, section in sections.items() if key in section.get("properties", {})]
