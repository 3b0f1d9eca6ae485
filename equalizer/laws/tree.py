"""Expression tree of a law's formula, and its formatting in Python's syntax, with parentheses where operator precedence
needs them."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

_SUM, _PRODUCT, _SIGN, _POWER, _ATOM = 1, 2, 3, 4, 5
"""Operator precedence, ascending."""
DIGITS = 5
"""Significant digits of displayed numbers. Chosen."""


@dataclass(frozen=True, slots=True)
class Number:
    """A number that is part of the formula's form and is not fitted."""

    value: float


@dataclass(frozen=True, slots=True)
class FreeParameter:
    """A free parameter `p0`, `p1`, …, whose value a fit may change. index: its number in the law, from 0."""

    index: int


@dataclass(frozen=True, slots=True)
class Variable:
    """A signal by its name, or the constant `pi`."""

    name: str


@dataclass(frozen=True, slots=True)
class Apply:
    """An operator or a function applied to its arguments."""

    name: str
    """Name of an operator (+ - * / **, `neg`) or a function; `arguments` are its arguments."""
    arguments: tuple["Node", ...]


Node = Number | FreeParameter | Variable | Apply
"""Node of an expression tree."""


def iterate_nodes(tree: Node) -> Iterator[Node]:
    """Iterate over all nodes of a tree, each before its arguments (preorder)."""
    yield tree
    for argument in tree.arguments if isinstance(tree, Apply) else ():
        yield from iterate_nodes(argument)


def format_formula(tree: Node, numbers: Sequence[float] | None = None, digits: int | None = DIGITS) -> str:
    """Format the formula in Python's syntax. numbers: values of `p0`, `p1`, …; without them these names are written.
    digits: significant digits of the values; None = as many as are needed to read the same values back."""
    return _format_node(tree, numbers, digits)[0]


def _format_node(tree: Node, numbers: Sequence[float] | None, digits: int | None) -> tuple[str, int]:
    """Format a node; returns its text and the precedence of its outermost operator, which decides where parentheses are
    needed."""
    match tree:
        case Number(value):
            return _format_signed(repr(float(value)).removesuffix(".0"))
        case FreeParameter(index):
            return (
                (f"p{index}", _ATOM) if numbers is None else _format_signed(_format_free_number(numbers[index], digits))
            )
        case Variable(name):
            return name, _ATOM
        case Apply("neg", (operand,)):
            return _format_negated(*_format_node(operand, numbers, digits))
        case Apply(name, (left, right)) if name in _OPERATORS:
            return _format_operation(name, _format_node(left, numbers, digits), _format_node(right, numbers, digits))
    arguments = ", ".join(_format_node(argument, numbers, digits)[0] for argument in tree.arguments)
    return f"{tree.name}({arguments})", _ATOM


def _format_free_number(value: float, digits: int | None) -> str:
    """Format a value with a point or an exponent, which mark it as a free parameter; see
    `equalizer.laws.law.parse_law`."""
    return repr(float(value) if digits is None else float(f"{value:.{digits}g}"))


def _format_signed(text: str) -> tuple[str, int]:
    """Find the precedence of a number's text: that of a sign for a negative number. Returns both."""
    return text, _SIGN if text.startswith("-") else _ATOM


def _format_negated(text: str, precedence: int) -> tuple[str, int]:
    """Format the negated operand, given its text and precedence; returns both of the result. A double sign is
    removed."""
    if precedence < _PRODUCT:
        return f"-({text})", _SIGN
    return (text[1:], min(precedence, _SIGN)) if text.startswith("-") else (f"-{text}", min(precedence, _SIGN))


_OPERATORS = {"+": _SUM, "-": _SUM, "*": _PRODUCT, "/": _PRODUCT, "**": _POWER}
"""Precedence of the binary operators."""


def _format_operation(name: str, left: tuple[str, int], right: tuple[str, int]) -> tuple[str, int]:
    """Format a binary operation; returns its text and precedence. left, right: text and precedence of the operands. For
    a negative second operand, `a + -b` is written `a - b`, and `a * -b` as `a*(-b)`."""
    precedence = _OPERATORS[name]
    if name == "**":
        return f"{_parenthesise(left, _ATOM)}**{_parenthesise(right, _SIGN)}", precedence
    left_text, right_text = _parenthesise(left, precedence), _parenthesise(right, precedence + 1)
    if precedence == _PRODUCT:
        return f"{left_text}{name}{f'({right_text})' if right_text.startswith('-') else right_text}", precedence
    if right_text.startswith("-"):
        return f"{left_text} {'+' if name == '-' else '-'} {right_text[1:]}", precedence
    return f"{left_text} {name} {right_text}", precedence


def _parenthesise(formatted: tuple[str, int], min_precedence: int) -> str:
    """Enclose a text in parentheses if its precedence is below `min_precedence`. formatted: text and precedence."""
    text, precedence = formatted
    return text if precedence >= min_precedence else f"({text})"
