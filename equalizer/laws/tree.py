"""Expression tree of a formula, and its formatting as text."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

_SUM, _PRODUCT, _SIGN, _POWER, _ATOM = 1, 2, 3, 4, 5
DIGITS = 5
"""Significant digits of displayed numbers."""


@dataclass(frozen=True, slots=True)
class Number:
    """A number that is part of the form: no fit changes it."""

    value: float


@dataclass(frozen=True, slots=True)
class Free:
    """A number that a fit may change: `p0`, `p1`, …"""

    place: int


@dataclass(frozen=True, slots=True)
class Variable:
    """A signal by its name, or the constant `pi`."""

    name: str


@dataclass(frozen=True, slots=True)
class Apply:
    """An operator or a function applied to its arguments."""

    name: str
    """An operator + - * / **, `neg`, or a function, with its arguments."""
    parts: tuple["Node", ...]


Node = Number | Free | Variable | Apply


def nodes(tree: Node) -> Iterator[Node]:
    """All nodes in the order of the text, each before its parts."""
    yield tree
    for part in tree.parts if isinstance(tree, Apply) else ():
        yield from nodes(part)


def format_formula(tree: Node, numbers: Sequence[float] | None = None, digits: int | None = DIGITS) -> str:
    """Python syntax. numbers: in place of `p0`, `p1`, …; without them these names are written. digits: of the numbers;
    None = all that are needed to read the same numbers back."""
    return _format_node(tree, numbers, digits)[0]


def _format_node(tree: Node, numbers: Sequence[float] | None, digits: int | None) -> tuple[str, int]:
    """The text, and its operator precedence, which decides where parentheses are needed."""
    match tree:
        case Number(value):
            return _format_signed(repr(float(value)).removesuffix(".0"))
        case Free(place):
            return (
                (f"p{place}", _ATOM) if numbers is None else _format_signed(_format_free_number(numbers[place], digits))
            )
        case Variable(name):
            return name, _ATOM
        case Apply("neg", (inner,)):
            return _format_negated(*_format_node(inner, numbers, digits))
        case Apply(name, (left, right)) if name in _OPERATORS:
            return _format_operation(name, _format_node(left, numbers, digits), _format_node(right, numbers, digits))
    inside = ", ".join(_format_node(part, numbers, digits)[0] for part in tree.parts)
    return f"{tree.name}({inside})", _ATOM


def _format_free_number(value: float, digits: int | None) -> str:
    """The number with a point or an exponent, which mark it as free; see `equalizer.laws.law.law_of`."""
    return repr(float(value) if digits is None else float(f"{value:.{digits}g}"))


def _format_signed(text: str) -> tuple[str, int]:
    return text, _SIGN if text.startswith("-") else _ATOM


def _format_negated(text: str, strength: int) -> tuple[str, int]:
    if strength < _PRODUCT:
        return f"-({text})", _SIGN
    return (text[1:], min(strength, _SIGN)) if text.startswith("-") else (f"-{text}", min(strength, _SIGN))


_OPERATORS = {"+": _SUM, "-": _SUM, "*": _PRODUCT, "/": _PRODUCT, "**": _POWER}


def _format_operation(name: str, left: tuple[str, int], right: tuple[str, int]) -> tuple[str, int]:
    own = _OPERATORS[name]
    if name == "**":
        return f"{_parenthesise(left, _ATOM)}**{_parenthesise(right, _SIGN)}", own
    first, second = _parenthesise(left, own), _parenthesise(right, own + 1)
    if own == _PRODUCT:
        return f"{first}{name}{f'({second})' if second.startswith('-') else second}", own
    if second.startswith("-"):
        return f"{first} {'+' if name == '-' else '-'} {second[1:]}", own
    return f"{first} {name} {second}", own


def _parenthesise(part: tuple[str, int], least: int) -> str:
    text, strength = part
    return text if strength >= least else f"({text})"
