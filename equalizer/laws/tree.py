"""A formula as a tree, and the tree as text again."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

_SUM, _PRODUCT, _SIGN, _POWER, _ATOM = 1, 2, 3, 4, 5
DIGITS = 5
"""Significant ones that a reader is shown."""


@dataclass(frozen=True, slots=True)
class Number:
    """Part of the form: no fit moves it."""

    value: float


@dataclass(frozen=True, slots=True)
class Free:
    """A number that a fit may move: `p0`, `p1`, …"""

    place: int


@dataclass(frozen=True, slots=True)
class Variable:
    name: str


@dataclass(frozen=True, slots=True)
class Apply:
    name: str
    """+ - * / **, `neg`, or a function."""
    parts: tuple["Node", ...]


Node = Number | Free | Variable | Apply


def nodes(tree: Node) -> Iterator[Node]:
    """From left to right as it is written, each before its parts."""
    yield tree
    for part in tree.parts if isinstance(tree, Apply) else ():
        yield from nodes(part)


def written(tree: Node, numbers: Sequence[float] | None = None, digits: int | None = DIGITS) -> str:
    """Python syntax. numbers: in place of `p0`, `p1`, …; without them these names are written. digits: of the numbers;
    None = all that are needed to read the same numbers back."""
    return _text(tree, numbers, digits)[0]


def _text(tree: Node, numbers: Sequence[float] | None, digits: int | None) -> tuple[str, int]:
    """The text, and how strongly it holds together."""
    match tree:
        case Number(value):
            return _signed(repr(float(value)).removesuffix(".0"))
        case Free(place):
            return (f"p{place}", _ATOM) if numbers is None else _signed(_free(numbers[place], digits))
        case Variable(name):
            return name, _ATOM
        case Apply("neg", (inner,)):
            return _negative(*_text(inner, numbers, digits))
        case Apply(name, (left, right)) if name in _OPERATORS:
            return _joined(name, _text(left, numbers, digits), _text(right, numbers, digits))
    inside = ", ".join(_text(part, numbers, digits)[0] for part in tree.parts)
    return f"{tree.name}({inside})", _ATOM


def _free(value: float, digits: int | None) -> str:
    """With a point or an exponent, which say that it is free; see `equalizer.laws.law.law_of`."""
    return repr(float(value) if digits is None else float(f"{value:.{digits}g}"))


def _signed(text: str) -> tuple[str, int]:
    return text, _SIGN if text.startswith("-") else _ATOM


def _negative(text: str, strength: int) -> tuple[str, int]:
    if strength < _PRODUCT:
        return f"-({text})", _SIGN
    return (text[1:], min(strength, _SIGN)) if text.startswith("-") else (f"-{text}", min(strength, _SIGN))


_OPERATORS = {"+": _SUM, "-": _SUM, "*": _PRODUCT, "/": _PRODUCT, "**": _POWER}


def _joined(name: str, left: tuple[str, int], right: tuple[str, int]) -> tuple[str, int]:
    own = _OPERATORS[name]
    if name == "**":
        return f"{_inside(left, _ATOM)}**{_inside(right, _SIGN)}", own
    first, second = _inside(left, own), _inside(right, own + 1)
    if own == _PRODUCT:
        return f"{first}{name}{f'({second})' if second.startswith('-') else second}", own
    if second.startswith("-"):
        return f"{first} {'+' if name == '-' else '-'} {second[1:]}", own
    return f"{first} {name} {second}", own


def _inside(part: tuple[str, int], least: int) -> str:
    text, strength = part
    return text if strength >= least else f"({text})"
