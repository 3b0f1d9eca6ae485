"""Parses a formula in Python's expression syntax, restricted to numbers, names, + - * / ** and the functions below. The
text is parsed to a syntax tree by Python's `ast` and never executed.

Numbers with a point or an exponent (`4.1`, `1e-3`) are free parameters, which a fit may change. Whole numbers (`2`) and
`pi` are part of the form. A template contains the names `p0`, `p1`, … of the free parameters instead of their values.
"""

import ast
import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from difflib import get_close_matches
from functools import lru_cache

import numpy as np

from equalizer.laws.tree import Apply, Free, Node, Number, Variable

FUNCTIONS: Mapping[str, int] = {
    "sin": 1, "cos": 1, "tan": 1, "exp": 1, "log": 1, "sqrt": 1, "abs": 1, "sign": 1, "tanh": 1, "atan": 1,
    "minimum": 2, "maximum": 2,
    "lag": 2, "play": 2, "delay": 2, "integral": 1,
}  # fmt: skip
"""Number of arguments of each function."""
MEMORY = ("lag", "play", "delay", "integral")
"""Operators with memory, of a signal s: lag(s, tau_s), play(s, half_width), delay(s, delay_s), integral(s)."""
LONGEST, LARGEST = 2000, 200
"""Largest number of characters, and of nodes of the syntax tree, of a formula."""
_OPERATORS: dict[type[ast.operator], str] = {
    ast.Add: "+", ast.Sub: "-", ast.Mult: "*", ast.Div: "/", ast.Pow: "**"
}  # fmt: skip
ALLOWED = "allowed are numbers, signals, pi, + - * / ** and " + ", ".join(FUNCTIONS)
"""Description of the language, for error messages."""


class LawError(ValueError):
    """The text is not a formula of this language. The message states the error and, where known, its position."""


@dataclass(slots=True)
class _Reader:
    """Converts Python's syntax tree to the tree of a law, and collects the free numbers. Methods raise LawError."""

    text: str
    template: bool
    numbers: list[float] = field(default_factory=list)
    count: int = 0

    def read(self, node: ast.expr) -> Node:
        self.count += 1
        if self.count > LARGEST:
            raise LawError(f"the law has more than {LARGEST} parts; shorten it")
        match node:
            case ast.Constant(value=int() | float() as value) if not isinstance(value, bool):
                return self._number(node, value)
            case ast.Name(id=name):
                return self._name(node, name)
            case ast.UnaryOp(op=ast.USub(), operand=inner):
                return Apply("neg", (self.read(inner),))
            case ast.UnaryOp(op=ast.UAdd(), operand=inner):
                return self.read(inner)
            case ast.BinOp(left=left, op=operator, right=right) if type(operator) in _OPERATORS:
                return Apply(_OPERATORS[type(operator)], (self.read(left), self.read(right)))
            case ast.Call(func=ast.Name(id=name), args=arguments, keywords=[]):
                return self._call(node, name, arguments)
        raise LawError(f"{self._position_text(node)} is not part of the language of laws; {ALLOWED}")

    def _number(self, node: ast.expr, value: float) -> Node:
        try:
            number = float(value)
        except OverflowError:
            number = np.inf
        if not np.isfinite(number):
            raise LawError(f"{self._position_text(node)} is larger than any number")
        if isinstance(value, int) or self.template:
            return Number(number)
        self.numbers.append(number)
        return Free(len(self.numbers) - 1)

    def _name(self, node: ast.expr, name: str) -> Node:
        if name == "pi":
            return Variable("pi")
        if free := re.fullmatch(r"p(\d{1,3})", name):
            if not self.template:
                raise LawError(f"{self._position_text(node)} stands for a free number; write the number itself")
            return Free(int(free[1]))
        if name in FUNCTIONS:
            raise LawError(f"{self._position_text(node)} is a function; it takes its arguments in parentheses")
        return Variable(name)

    def _call(self, node: ast.expr, name: str, arguments: list[ast.expr]) -> Node:
        if name not in FUNCTIONS:
            matches = get_close_matches(name[:60], FUNCTIONS, n=1)
            hint = f" (did you mean '{matches[0]}'?)" if matches else ""
            raise LawError(f"{self._position_text(node)}: there is no function '{name}'{hint}; {ALLOWED}")
        if len(arguments) != FUNCTIONS[name]:
            expected = f"{FUNCTIONS[name]} argument{'s' if FUNCTIONS[name] > 1 else ''}"
            raise LawError(f"{self._position_text(node)}: {name} takes {expected}, not {len(arguments)}")
        parts = tuple(self.read(argument) for argument in arguments)
        if name in MEMORY[:3] and any(isinstance(leaf, Variable) and leaf.name != "pi" for leaf in _leaves(parts[1])):
            raise LawError(f"{self._position_text(arguments[1])}: the second argument of {name} must be a constant")
        return Apply(name, parts)

    def _position_text(self, node: ast.expr) -> str:
        part = ast.get_source_segment(self.text, node) or self.text
        excerpt = part if len(part) <= 40 else f"{part[:40]}…"
        return f"'{excerpt}' at character {_column(self.text, node) + 1}"


@lru_cache(maxsize=4096)
def parse_formula(text: str, template: bool = False) -> tuple[Node, tuple[float, ...]]:
    """The expression tree of a formula, and the values of its free parameters p0, p1, … in the order of the text.
    template: the text contains the parameters' names, and all numbers in it are part of the form. Raises LawError."""
    text = text.strip()
    if not text:
        raise LawError("the law is empty")
    if len(text) > LONGEST:
        raise LawError(f"the law has {len(text)} characters; up to {LONGEST} are read")
    try:
        body = ast.parse(text, mode="eval").body
    except (SyntaxError, ValueError, MemoryError, RecursionError, SyntaxWarning) as error:
        raise LawError(_not_python(text, error)) from error
    reader = _Reader(text, template)
    try:
        return reader.read(body), tuple(reader.numbers)
    except RecursionError as error:
        raise LawError("the law is nested too deeply; write it with fewer brackets") from error


def _not_python(text: str, error: BaseException) -> str:
    excerpt = text if len(text) <= 40 else f"{text[:40]}…"
    if isinstance(error, SyntaxError) and error.offset:
        return f"'{excerpt}' cannot be read at character {error.offset}: {error.msg}; {ALLOWED}"
    return f"'{excerpt}' cannot be read; {ALLOWED}"


def _column(text: str, node: ast.expr) -> int:
    """Position of a node in the text in characters, from 0; Python's syntax tree counts lines, and bytes of UTF-8 in
    each line."""
    lines = text.splitlines(keepends=True)
    characters = sum(len(line) for line in lines[: node.lineno - 1])
    return characters + len(lines[node.lineno - 1].encode()[: node.col_offset].decode(errors="replace"))


def _leaves(tree: Node) -> list[Node]:
    return [leaf for part in tree.arguments for leaf in _leaves(part)] if isinstance(tree, Apply) else [tree]
