"""What each free number of a law is for, which says how a fit may move it."""

from typing import Literal

from equalizer.laws.tree import Apply, Free, Node

Role = Literal["factor", "exponent", "positive", "phase", "offset"]
"""factor: the law's terms go with it; positive: a width, a time, a pitch; phase: of a sine, rad; offset: anything
else."""
_SECOND: dict[str, Role] = {
    "**": "exponent",
    "/": "positive",
    "lag": "positive",
    "play": "positive",
    "delay": "positive",
}


def roles(tree: Node) -> dict[int, Role]:
    """By the number's place. Of one that stands in several parts, as it stands first."""
    found: dict[int, Role] = {}
    _find(tree, "factor", found)
    return found


def _find(node: Node, role: Role, found: dict[int, Role]) -> None:
    if isinstance(node, Free):
        found.setdefault(node.place, role)
        return
    if not isinstance(node, Apply):
        return
    for place, part in enumerate(node.parts):
        _find(part, _SECOND.get(node.name, _first(node.name, role)) if place else _first(node.name, role), found)


def _first(name: str, role: Role) -> Role:
    """Of an operator's first part, or of each."""
    if name in ("+", "-", "neg"):
        return role
    if name in ("*", "/"):
        return "factor" if role == "factor" else "positive"
    return "phase" if name in ("sin", "cos", "tan") else "offset"
