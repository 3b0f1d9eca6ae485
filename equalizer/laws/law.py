"""A law: a formula with free parameters, and the quantity on which it acts (force, command or response).

`parse_law` reads one from text; `find_parameter_roles` tells a fit how each parameter enters the formula.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal, get_args

from equalizer.laws.parse import LawError, parse_formula
from equalizer.laws.tree import Apply, FreeParameter, Node, Number, Variable, format_formula, iterate_nodes

ActsOn = Literal["force", "command", "response"]
ACTS_ON_VALUES: tuple[ActsOn, ...] = get_args(ActsOn)
"""All values of `ActsOn`."""


@dataclass(frozen=True, slots=True)
class Law:
    """A formula with free parameters, and the quantity on which it acts. Raises LawError where the formula is not in
    the language, or its parameters do not fit it."""

    expression: str
    """Template with free parameters p0, p1, …: '-p0*abs(vy)**p1*sign(vy)'. Literal numbers in it are part of the
    form."""
    numbers: tuple[float, ...]
    """Values of p0, p1, … in SI units."""
    units: tuple[str, ...]
    """Units of the parameters; empty where not known."""
    acts_on: ActsOn
    """Quantity on which the law acts. force: its value is added to the force at the axis; command, response: its value
    replaces the command or the response of the axis."""
    axis: str
    """Letter of the axis ('y'), or name of the channel."""

    def __post_init__(self) -> None:
        if self.acts_on not in ACTS_ON_VALUES:
            raise LawError(f"a law acts on {', '.join(ACTS_ON_VALUES)}; not on '{self.acts_on}'")
        if not self.axis:
            raise LawError("the law does not state the axis on which it acts; state its axis")
        used_indices = {node.index for node in iterate_nodes(self.tree) if isinstance(node, FreeParameter)}
        if used_indices != set(range(len(self.numbers))):
            parameter_names = ", ".join(f"p{index}" for index in sorted(used_indices)) or "none"
            raise LawError(f"the law names the free numbers {parameter_names}, but {len(self.numbers)} are given")
        if self.units and len(self.units) != len(self.numbers):
            raise LawError(f"the law has {len(self.numbers)} free numbers and {len(self.units)} units")

    @property
    def tree(self) -> Node:
        """Syntax tree of the expression; its free parameters are nodes `FreeParameter` with their index."""
        return parse_formula(self.expression, template=True)[0]

    @property
    def text(self) -> str:
        """The formula with the values of its parameters, to five digits."""
        return format_formula(self.tree, self.numbers)

    @property
    def exact_text(self) -> str:
        """The formula with all digits: `parse_law` gives the same parameter values."""
        return format_formula(self.tree, self.numbers, None)

    @property
    def variables(self) -> tuple[str, ...]:
        """Signals in the formula, sorted."""
        return tuple(sorted({node.name for node in iterate_nodes(self.tree) if isinstance(node, Variable)} - {"pi"}))

    @property
    def exponents(self) -> tuple[float, ...]:
        """Exponents in the formula, in their order: free parameters and literal numbers, but not expressions."""
        powers = [node for node in iterate_nodes(self.tree) if isinstance(node, Apply) and node.name == "**"]
        exponents = [power.arguments[1] for power in powers]
        return tuple(
            self.numbers[exponent.index] if isinstance(exponent, FreeParameter) else exponent.value
            for exponent in exponents
            if isinstance(exponent, FreeParameter | Number)
        )

    def replace_numbers(self, numbers: Sequence[float]) -> "Law":
        """Return the law with other values of p0, p1, … in SI units. Raises LawError for another number of them."""
        return replace(self, numbers=tuple(float(number) for number in numbers))


def parse_law(text: str, acts_on: ActsOn, axis: str) -> Law:
    """Parse a law from a formula with numbers. Those with a point or an exponent become free:
    '-4.1*abs(vy)**1.5*sign(vy)' is '-p0*abs(vy)**p1*sign(vy)' with 4.1 and 1.5; in '-4.1*vy**2' the 2 stays. acts_on
    and axis: as in `Law`. Raises LawError where the text is not a formula of the language, or acts_on or axis is
    invalid."""
    tree, numbers = parse_formula(text)
    return Law(format_formula(tree), numbers, (), acts_on, axis)


Role = Literal["factor", "exponent", "positive", "phase", "offset"]
"""Role of a free parameter. factor: terms are proportional to it; exponent: of a power; positive: a width, a time, a
pitch; phase: of a sine (rad); offset: any other."""
_SECOND_ARGUMENT_ROLES: dict[str, Role] = {
    "**": "exponent",
    "/": "positive",
    "lag": "positive",
    "play": "positive",
    "delay": "positive",
}
"""Role of the second argument of these operators; of all others it is that of the first."""


def find_parameter_roles(tree: Node) -> dict[int, Role]:
    """Find the role of each free parameter, by its index; of several occurrences, the first counts."""
    role_by_index: dict[int, Role] = {}
    _collect_roles(tree, "factor", role_by_index)
    return role_by_index


def _collect_roles(node: Node, role: Role, role_by_index: dict[int, Role]) -> None:
    """Add the roles of the parameters in an expression, which itself has the role `role`, to `role_by_index`."""
    if isinstance(node, FreeParameter):
        role_by_index.setdefault(node.index, role)
        return
    if not isinstance(node, Apply):
        return
    for position, argument in enumerate(node.arguments):
        _collect_roles(
            argument,
            _SECOND_ARGUMENT_ROLES.get(node.name, _find_first_argument_role(node.name, role))
            if position
            else _find_first_argument_role(node.name, role),
            role_by_index,
        )


def _find_first_argument_role(name: str, role: Role) -> Role:
    """Find the role of the first argument of an operator or function `name` whose value has the role `role`; of + - *
    the role of each argument."""
    if name in ("+", "-", "neg"):
        return role
    if name in ("*", "/"):
        return "factor" if role == "factor" else "positive"
    return "phase" if name in ("sin", "cos", "tan") else "offset"
