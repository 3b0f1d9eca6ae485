"""Expressions of a map: arithmetic over arrays, and nothing else. Read by Python's parser, never evaluated by it.

What is not in the lists below is refused by name: no attributes, no calls but ours, no comprehensions.
"""

import ast
import warnings
from collections.abc import Callable
from typing import Any

import numpy as np
import numpy.typing as npt

from study.importing.functions import FUNCTIONS, Clock, Value
from study.importing.map_errors import ImportProblemError, suggestion

Lookup = Callable[[str], Value]
"""The value of a name. Raises ImportProblemError for one that is not there."""

LONGEST = 2000
DEEPEST = 200
LARGEST = 200_000_000

_OPERATIONS: dict[type[ast.operator], Callable[[Any, Any], Any]] = {
    ast.Add: np.add,
    ast.Sub: np.subtract,
    ast.Mult: np.multiply,
    ast.Div: np.divide,
    ast.Pow: np.power,
    ast.Mod: np.mod,
}
_COMPARISONS: dict[type[ast.cmpop], Callable[[Any, Any], Any]] = {
    ast.Lt: np.less,
    ast.LtE: np.less_equal,
    ast.Gt: np.greater,
    ast.GtE: np.greater_equal,
}
ALLOWED = "allowed are numbers, names, + - * / ** %, < <= > >=, [ ] and the functions " + ", ".join(sorted(FUNCTIONS))


def evaluate(text: str, lookup: Lookup, clock: Clock) -> Value:
    """The value of an expression: an array of float64, or a number as an array of shape ().

    Raises ImportProblemError with the part that is not understood.
    """
    tree = parsed(text)
    with np.errstate(all="ignore"), warnings.catch_warnings():
        warnings.simplefilter("ignore", RuntimeWarning)  # the mean of nothing is NaN, which is told as such later
        value: Value | str = _Evaluation(text, lookup, clock).of(tree, 0)
    if isinstance(value, str):
        raise ImportProblemError(f"'{text}' is a text, not numbers")
    return value


def names_in(text: str) -> set[str]:
    """Of arrays, channels and definitions that an expression needs. Raises ImportProblemError."""
    tree = parsed(text)
    functions = {id(node.func) for node in ast.walk(tree) if isinstance(node, ast.Call)}
    plain = {node.id for node in ast.walk(tree) if isinstance(node, ast.Name) and id(node) not in functions}
    quoted = {node.value for node in ast.walk(tree) if isinstance(node, ast.Constant) and isinstance(node.value, str)}
    return (plain | quoted) - {"pi", "clock_s", "rate_hz"}


def parsed(text: str) -> ast.expr:
    """Raises ImportProblemError."""
    if not text.strip():
        raise ImportProblemError("the expression is empty")
    if len(text) > LONGEST:
        raise ImportProblemError(f"the expression has {len(text)} characters; up to {LONGEST} are read")
    try:
        return ast.parse(text.strip(), mode="eval").body
    except (SyntaxError, ValueError, MemoryError, RecursionError) as error:
        raise ImportProblemError(f"'{text}' is not an expression ({_reason(error)}); {ALLOWED}") from error


class _Evaluation:
    def __init__(self, text: str, lookup: Lookup, clock: Clock) -> None:
        self.text = text
        self.lookup = lookup
        self.clock = clock

    def of(self, node: ast.expr, depth: int) -> Any:
        if depth > DEEPEST:
            raise ImportProblemError(f"'{self.text}' is nested too deeply")
        match node:
            case ast.Constant() | ast.Name():
                return self._leaf(node)
            case ast.UnaryOp(op=ast.USub(), operand=inner):
                return np.negative(self._numbers(inner, depth))
            case ast.UnaryOp(op=ast.UAdd(), operand=inner):
                return self._numbers(inner, depth)
            case ast.BinOp(left=left, op=operator, right=right) if type(operator) in _OPERATIONS:
                return self._together(_OPERATIONS[type(operator)], left, right, depth)
            case ast.Compare(left=left, ops=[order], comparators=[right]) if type(order) in _COMPARISONS:
                return self._together(_COMPARISONS[type(order)], left, right, depth)
            case ast.Call(func=ast.Name(id=name), args=arguments, keywords=[]):
                return self._call(name, arguments, depth)
            case ast.Subscript(value=inner, slice=index):
                return self._part(inner, index, depth)
        raise self._refused(node)

    def _leaf(self, node: ast.Constant | ast.Name) -> Any:
        match node:
            case ast.Name(id="pi"):
                return np.float64(np.pi)
            case ast.Name(id=name):
                return self.lookup(name)
            case ast.Constant(value=str() as word):
                return word
            case ast.Constant(value=int() | float() as number) if not isinstance(number, bool) and abs(number) < 1e300:
                return np.float64(number)
        raise self._refused(node)

    def _numbers(self, node: ast.expr, depth: int) -> Value:
        value = self.of(node, depth + 1)
        if isinstance(value, str):
            raise ImportProblemError(f"in '{self.text}' the text '{value}' stands where numbers are needed")
        numbers: Value = value
        return numbers

    def _together(self, operation: Callable[[Any, Any], Any], left: ast.expr, right: ast.expr, depth: int) -> Value:
        one, two = self._numbers(left, depth), self._numbers(right, depth)
        try:
            return np.asarray(operation(one, two), dtype=np.float64)
        except ValueError as error:
            raise ImportProblemError(
                f"in '{self.text}' arrays of the shapes {np.shape(one)} and {np.shape(two)} do not go together"
            ) from error

    def _call(self, name: str, arguments: list[ast.expr], depth: int) -> Value:
        if name == "array":
            return self._quoted(arguments)
        if name not in FUNCTIONS:
            raise ImportProblemError(
                f"in '{self.text}' there is no function '{name}'{suggestion(name, FUNCTIONS)}; {ALLOWED}"
            )
        function = FUNCTIONS[name]
        if not function.fewest <= len(arguments) <= function.most:
            raise ImportProblemError(f"in '{self.text}' {function.usage} was given {len(arguments)} values")
        values = [self._numbers(argument, depth) for argument in arguments]
        if name == "repeat" and np.size(values[0]) * float(np.max(values[1])) > LARGEST:
            raise ImportProblemError(f"'{self.text}' would give more than {LARGEST} numbers")
        try:
            return np.asarray(function.call(self.clock, *values), dtype=np.float64)
        except (ValueError, IndexError, TypeError) as error:
            raise ImportProblemError(f"in '{self.text}' {function.usage} fails: {error}") from error

    def _quoted(self, arguments: list[ast.expr]) -> Value:
        match arguments:
            case [ast.Constant(value=str() as name)]:
                return self.lookup(name)
        raise ImportProblemError(f"in '{self.text}' array(\"NAME\") takes one name in quotes")

    def _part(self, inner: ast.expr, index: ast.expr, depth: int) -> Value:
        whole = self._numbers(inner, depth)
        entries = index.elts if isinstance(index, ast.Tuple) else [index]
        try:
            part: npt.NDArray[np.float64] = np.asarray(whole)[tuple(self._index(entry, depth) for entry in entries)]
        except IndexError as error:
            raise ImportProblemError(f"in '{self.text}' the index is outside the shape {np.shape(whole)}") from error
        return part

    def _index(self, node: ast.expr, depth: int) -> int | slice:
        if isinstance(node, ast.Slice):
            bounds = (node.lower, node.upper, node.step)
            return slice(*(None if bound is None else self._whole(bound, depth) for bound in bounds))
        return self._whole(node, depth)

    def _whole(self, node: ast.expr, depth: int) -> int:
        number = self._numbers(node, depth)
        if np.ndim(number) or float(number) != int(number):
            raise ImportProblemError(f"in '{self.text}' an index is not a whole number")
        return int(number)

    def _refused(self, node: ast.expr) -> ImportProblemError:
        return ImportProblemError(f"in '{self.text}' this is not understood: {ast.unparse(node)}; {ALLOWED}")


def _reason(error: BaseException) -> str:
    return error.msg if isinstance(error, SyntaxError) else type(error).__name__
