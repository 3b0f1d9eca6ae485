"""A law: a formula with free parameters, and what it acts on (force, command or response)."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal, get_args

from equalizer.laws.parse import LawError, parse_formula
from equalizer.laws.tree import Apply, Free, Node, Variable, format_formula, iterate_nodes

ActsOn = Literal["force", "command", "response"]
KINDS: tuple[ActsOn, ...] = get_args(ActsOn)


@dataclass(frozen=True, slots=True)
class Law:
    """A formula with free parameters, and what it acts on. Raises LawError where the formula is not in the language, or
    its parameters do not fit it."""

    expression: str
    """Template with free parameters p0, p1, …: '-p0*abs(vy)**p1*sign(vy)'. Literal numbers in it are part of the
    form."""
    numbers: tuple[float, ...]
    """Values of p0, p1, … in SI units."""
    units: tuple[str, ...]
    """Units of the parameters; empty where not known."""
    acts_on: ActsOn
    """What the law acts on. force: it is added to the force at the axis; command, response: it replaces that of the
    axis."""
    axis: str
    """Letter of the axis ('y'), or name of the channel."""

    def __post_init__(self) -> None:
        if self.acts_on not in KINDS:
            raise LawError(f"a law acts on {', '.join(KINDS)}; not on '{self.acts_on}'")
        if not self.axis:
            raise LawError("the law does not state the axis on which it acts; state its axis")
        used = {node.index for node in iterate_nodes(self.tree) if isinstance(node, Free)}
        if used != set(range(len(self.numbers))):
            names = ", ".join(f"p{place}" for place in sorted(used)) or "none"
            raise LawError(f"the law names the free numbers {names}, but {len(self.numbers)} are given")
        if self.units and len(self.units) != len(self.numbers):
            raise LawError(f"the law has {len(self.numbers)} free numbers and {len(self.units)} units")

    @property
    def tree(self) -> Node:
        """Syntax tree of the expression; its free parameters are nodes `Free` with their place."""
        return parse_formula(self.expression, template=True)[0]

    @property
    def text(self) -> str:
        """The formula with the values of its parameters, to five digits."""
        return format_formula(self.tree, self.numbers)

    @property
    def exact_text(self) -> str:
        """The formula with all digits: `law_of` reads the same values back."""
        return format_formula(self.tree, self.numbers, None)

    @property
    def variables(self) -> tuple[str, ...]:
        """Signals in the formula, sorted."""
        return tuple(sorted({node.name for node in iterate_nodes(self.tree) if isinstance(node, Variable)} - {"pi"}))

    def with_numbers(self, numbers: Sequence[float]) -> "Law":
        """The law with other values of p0, p1, … in SI units. Raises LawError for another number of them."""
        return replace(self, numbers=tuple(float(number) for number in numbers))


def law_of(text: str, acts_on: ActsOn, axis: str) -> Law:
    """A law from a formula with numbers. Those with a point or an exponent become free: '-4.1*abs(vy)**1.5*sign(vy)' is
    '-p0*abs(vy)**p1*sign(vy)' with 4.1 and 1.5; in '-4.1*vy**2' the 2 stays. Raises LawError."""
    tree, numbers = parse_formula(text)
    return Law(format_formula(tree), numbers, (), acts_on, axis)


Role = Literal["factor", "exponent", "positive", "phase", "offset"]
"""Role of a free parameter. factor: terms are proportional to it; positive: a width, a time, a pitch; phase: of a sine
(rad); offset: any other."""
_SECOND_ARGUMENT: dict[str, Role] = {
    "**": "exponent",
    "/": "positive",
    "lag": "positive",
    "play": "positive",
    "delay": "positive",
}


def roles(tree: Node) -> dict[int, Role]:
    """Role of each free parameter, by its place; where one occurs several times, by its first occurrence."""
    role_by_place: dict[int, Role] = {}
    _collect_roles(tree, "factor", role_by_place)
    return role_by_place


def _collect_roles(node: Node, role: Role, role_by_place: dict[int, Role]) -> None:
    if isinstance(node, Free):
        role_by_place.setdefault(node.index, role)
        return
    if not isinstance(node, Apply):
        return
    for place, part in enumerate(node.arguments):
        _collect_roles(
            part,
            _SECOND_ARGUMENT.get(node.name, _first_part_role(node.name, role))
            if place
            else _first_part_role(node.name, role),
            role_by_place,
        )


def _first_part_role(name: str, role: Role) -> Role:
    """Role that an operator in the role `role` gives to its first argument; + - * to each."""
    if name in ("+", "-", "neg"):
        return role
    if name in ("*", "/"):
        return "factor" if role == "factor" else "positive"
    return "phase" if name in ("sin", "cos", "tan") else "offset"
