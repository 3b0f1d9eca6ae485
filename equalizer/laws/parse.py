"""Parser of formulas in Python's expression syntax, restricted to numbers, names, + - * / ** and the functions below.
The text is parsed to a syntax tree by Python's `ast` and never executed.

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

from equalizer.laws.tree import Apply, FreeParameter, Node, Number, Variable

FUNCTIONS: Mapping[str, int] = {
    "sin": 1, "cos": 1, "tan": 1, "exp": 1, "log": 1, "sqrt": 1, "abs": 1, "sign": 1, "tanh": 1, "atan": 1,
    "minimum": 2, "maximum": 2,
    "lag": 2, "play": 2, "delay": 2, "integral": 1,
}  # fmt: skip
"""Number of arguments of each function."""
MEMORY_OPERATORS = ("lag", "play", "delay", "integral")
"""Operators with memory, of a signal s: lag(s, tau_s), play(s, half_width), delay(s, delay_s), integral(s); times in s,
half_width in the unit of s."""
MAX_CHARACTERS, MAX_NODES = 2000, 200
"""Largest number of characters, and of nodes of the syntax tree, of a formula. Chosen: they bound the parsing time."""
_OPERATORS: dict[type[ast.operator], str] = {
    ast.Add: "+", ast.Sub: "-", ast.Mult: "*", ast.Div: "/", ast.Pow: "**"
}  # fmt: skip
"""Symbol of each binary operator, by its class in `ast`."""
ALLOWED_ELEMENTS = "allowed are numbers, signals, pi, + - * / ** and " + ", ".join(FUNCTIONS)
"""Description of the language, for error messages."""


class LawError(ValueError):
    """A law cannot be read or evaluated: its text is not a formula of this language, or its parameters, its axis or the
    signals that it is given do not fit it. The message states the error and, where known, its position."""


@dataclass(slots=True)
class _TreeConverter:
    """Converter of Python's syntax tree to the tree of a law; it collects the free numbers in the order of the text.
    Methods raise LawError for text outside the language. text, template: see `parse_formula`."""

    text: str
    template: bool
    numbers: list[float] = field(default_factory=list)
    node_count: int = 0

    def convert(self, node: ast.expr) -> Node:
        """Convert a node of Python's syntax tree, with all nodes below it."""
        self.node_count += 1
        if self.node_count > MAX_NODES:
            raise LawError(f"the law has more than {MAX_NODES} parts; shorten it")
        match node:
            case ast.Constant(value=int() | float() as value) if not isinstance(value, bool):
                return self._convert_number(node, value)
            case ast.Name(id=name):
                return self._convert_name(node, name)
            case ast.UnaryOp(op=ast.USub(), operand=inner):
                return Apply("neg", (self.convert(inner),))
            case ast.UnaryOp(op=ast.UAdd(), operand=inner):
                return self.convert(inner)
            case ast.BinOp(left=left, op=operator, right=right) if type(operator) in _OPERATORS:
                return Apply(_OPERATORS[type(operator)], (self.convert(left), self.convert(right)))
            case ast.Call(func=ast.Name(id=name), args=arguments, keywords=[]):
                return self._convert_call(node, name, arguments)
        raise LawError(f"{self._describe_position(node)} is not part of the language of laws; {ALLOWED_ELEMENTS}")

    def _convert_number(self, node: ast.expr, value: float) -> Node:
        """Convert a number: to a free parameter if it has a point or an exponent and is outside a template, else to a
        fixed number. Raises LawError where it overflows a 64-bit float."""
        try:
            number = float(value)
        except OverflowError:
            number = np.inf
        if not np.isfinite(number):
            raise LawError(f"{self._describe_position(node)} is larger than any number")
        if isinstance(value, int) or self.template:
            return Number(number)
        self.numbers.append(number)
        return FreeParameter(len(self.numbers) - 1)

    def _convert_name(self, node: ast.expr, name: str) -> Node:
        """Convert a name: pi, a free parameter p0 to p999 (in a template only), or a signal, whose name is not
        checked."""
        if name == "pi":
            return Variable("pi")
        if parameter_match := re.fullmatch(r"p(\d{1,3})", name):
            if not self.template:
                raise LawError(f"{self._describe_position(node)} stands for a free number; write the number itself")
            return FreeParameter(int(parameter_match[1]))
        if name in FUNCTIONS:
            raise LawError(f"{self._describe_position(node)} is a function; it takes its arguments in parentheses")
        return Variable(name)

    def _convert_call(self, node: ast.expr, name: str, arguments: list[ast.expr]) -> Node:
        """Convert a call of a function of `FUNCTIONS`; the second argument of an operator with memory must be
        constant."""
        if name not in FUNCTIONS:
            matches = get_close_matches(name[:60], FUNCTIONS, n=1)
            suggestion = f" (did you mean '{matches[0]}'?)" if matches else ""
            raise LawError(
                f"{self._describe_position(node)}: there is no function '{name}'{suggestion}; {ALLOWED_ELEMENTS}"
            )
        if len(arguments) != FUNCTIONS[name]:
            expected_count = f"{FUNCTIONS[name]} argument{'s' if FUNCTIONS[name] > 1 else ''}"
            raise LawError(f"{self._describe_position(node)}: {name} takes {expected_count}, not {len(arguments)}")
        argument_trees = tuple(self.convert(argument) for argument in arguments)
        if name in MEMORY_OPERATORS[:3] and any(
            isinstance(leaf, Variable) and leaf.name != "pi" for leaf in _list_leaves(argument_trees[1])
        ):
            raise LawError(f"{self._describe_position(arguments[1])}: the second argument of {name} must be a constant")
        return Apply(name, argument_trees)

    def _describe_position(self, node: ast.expr) -> str:
        """Describe a node for an error message: its text, to 40 characters, and its position in characters from 1."""
        source = ast.get_source_segment(self.text, node) or self.text
        excerpt = source if len(source) <= 40 else f"{source[:40]}…"
        return f"'{excerpt}' at character {_find_column(self.text, node) + 1}"


@lru_cache(maxsize=4096)
def parse_formula(text: str, template: bool = False) -> tuple[Node, tuple[float, ...]]:
    """Parse a formula; returns its expression tree, and the values of its free parameters p0, p1, … in the order of the
    text. template: the text contains the parameters' names, all numbers in it are part of the form, and no values are
    returned. Raises LawError where the text is empty, too long, or outside the language."""
    text = text.strip()
    if not text:
        raise LawError("the law is empty")
    if len(text) > MAX_CHARACTERS:
        raise LawError(f"the law has {len(text)} characters; up to {MAX_CHARACTERS} are read")
    try:
        body = ast.parse(text, mode="eval").body
    except (SyntaxError, ValueError, MemoryError, RecursionError, SyntaxWarning) as error:
        raise LawError(_describe_syntax_error(text, error)) from error
    converter = _TreeConverter(text, template)
    try:
        return converter.convert(body), tuple(converter.numbers)
    except RecursionError as error:
        raise LawError("the law is nested too deeply; write it with fewer brackets") from error


def _describe_syntax_error(text: str, error: BaseException) -> str:
    """Describe the error of a text that is no Python expression, with the position in its line (from 1) if known."""
    excerpt = text if len(text) <= 40 else f"{text[:40]}…"
    if isinstance(error, SyntaxError) and error.offset:
        return f"'{excerpt}' cannot be read at character {error.offset}: {error.msg}; {ALLOWED_ELEMENTS}"
    return f"'{excerpt}' cannot be read; {ALLOWED_ELEMENTS}"


def _find_column(text: str, node: ast.expr) -> int:
    """Find the position of a node in the text in characters, from 0; Python's syntax tree counts lines, and bytes of
    UTF-8 in each line."""
    lines = text.splitlines(keepends=True)
    characters = sum(len(line) for line in lines[: node.lineno - 1])
    return characters + len(lines[node.lineno - 1].encode()[: node.col_offset].decode(errors="replace"))


def _list_leaves(tree: Node) -> list[Node]:
    """List the numbers, parameters and signals of an expression tree, from left to right."""
    return (
        [leaf for argument in tree.arguments for leaf in _list_leaves(argument)] if isinstance(tree, Apply) else [tree]
    )
