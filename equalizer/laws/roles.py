"""Role of each free number in a law's formula, which decides its range and scale in a fit."""

from typing import Literal

from equalizer.laws.tree import Apply, Free, Node

Role = Literal["factor", "exponent", "positive", "phase", "offset"]
"""factor: terms are proportional to it; positive: a width, a time, a pitch; phase: of a sine, rad; offset: anything
else."""
_SECOND: dict[str, Role] = {
    "**": "exponent",
    "/": "positive",
    "lag": "positive",
    "play": "positive",
    "delay": "positive",
}


def roles(tree: Node) -> dict[int, Role]:
    """Role of each free number, by its place; where a number occurs several times, by its first occurrence."""
    found: dict[int, Role] = {}
    _collect_roles(tree, "factor", found)
    return found


def _collect_roles(node: Node, role: Role, found: dict[int, Role]) -> None:
    if isinstance(node, Free):
        found.setdefault(node.place, role)
        return
    if not isinstance(node, Apply):
        return
    for place, part in enumerate(node.parts):
        _collect_roles(
            part,
            _SECOND.get(node.name, _first_part_role(node.name, role)) if place else _first_part_role(node.name, role),
            found,
        )


def _first_part_role(name: str, role: Role) -> Role:
    """Roles that an operator gives to its first argument, or to each."""
    if name in ("+", "-", "neg"):
        return role
    if name in ("*", "/"):
        return "factor" if role == "factor" else "positive"
    return "phase" if name in ("sin", "cos", "tan") else "offset"
