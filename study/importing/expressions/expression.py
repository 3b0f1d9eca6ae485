"""Evaluate the expressions of an import map: arithmetic over arrays.

The text is parsed by Python's parser and evaluated here on the syntax tree, never by Python itself. All constructs that
are not in the lists below are refused, such as attributes, other function calls, comprehensions. Begin at `evaluate`.
"""

import ast
import math
import warnings
from collections.abc import Callable, Sequence
from functools import lru_cache
from keyword import iskeyword
from typing import Any

import numpy as np
import numpy.typing as npt

from study.importing.expressions.budget import Budget
from study.importing.expressions.functions import FUNCTIONS, Clock, Value
from study.importing.map_format.map_errors import ImportProblemError, suggest_name

Lookup = Callable[[str], Value]
"""Returns the value of a name. Raises ImportProblemError for an unknown name."""

LONGEST_EXPRESSION = 2000
"""Longest expression of a map, in characters: parsing takes time and stack depth. Chosen."""
_CALL_COST = 20
"""Cost of a function call per element, in additions: the slowest functions sort, or compute a sine. Chosen."""

_OPERATIONS: dict[type[ast.operator], Callable[[Any, Any], Any]] = {
    ast.Add: np.add,
    ast.Sub: np.subtract,
    ast.Mult: np.multiply,
    ast.Div: np.divide,
    ast.Pow: np.power,
    ast.Mod: np.mod,
}
"""Operators between arrays, and the functions that compute them."""
_COMPARISONS: dict[type[ast.cmpop], Callable[[Any, Any], Any]] = {
    ast.Lt: np.less,
    ast.LtE: np.less_equal,
    ast.Gt: np.greater,
    ast.GtE: np.greater_equal,
}
"""Comparisons of arrays, and the functions that compute them; the results count as 0 and 1."""
ALLOWED = "allowed are numbers, names, + - * / ** %, < <= > >=, [ ] and the functions " + ", ".join(sorted(FUNCTIONS))
"""What an expression may contain, for messages."""


def evaluate(text: str, lookup: Lookup, clock: Clock, budget: Budget) -> Value:
    """Evaluate an expression to an array of float64; a single number has the shape (). text: the expression; lookup,
    clock: give the values of names and the times of the samples. Raises ImportProblemError with the part that is not
    understood, or that exceeds the budget."""
    tree = parse_expression(text)
    try:
        with np.errstate(all="ignore"), warnings.catch_warnings():
            warnings.simplefilter("ignore", RuntimeWarning)  # the mean of nothing is NaN, which is reported later
            value: Value | str = _Evaluation(text, lookup, clock, budget).evaluate_node(tree)
    except (MemoryError, RecursionError) as error:
        raise ImportProblemError(f"'{text}' needs more memory than there is") from error
    if isinstance(value, str):
        raise ImportProblemError(f"'{text}' is a text, not numbers")
    return value


def find_names(text: str) -> set[str]:
    """Find the names of arrays, channels and definitions that an expression uses; without the functions, `pi`, and
    the variables `clock_s` and `rate_hz`. Raises ImportProblemError where it cannot be parsed."""
    tree = parse_expression(text)
    function_nodes = {id(node.func) for node in ast.walk(tree) if isinstance(node, ast.Call)}
    identifiers = {node.id for node in ast.walk(tree) if isinstance(node, ast.Name) and id(node) not in function_nodes}
    quoted = {node.value for node in ast.walk(tree) if isinstance(node, ast.Constant) and isinstance(node.value, str)}
    return (identifiers - {"pi", "clock_s", "rate_hz"}) | quoted


def quote_name(name: str) -> str:
    """Write the expression for an array: its name, or `array('name')` where that is no identifier of its own."""
    is_own_identifier = name.isidentifier() and not iskeyword(name) and name != "pi"
    return name if is_own_identifier else f"array({name!r})"


@lru_cache(maxsize=1024)
def parse_expression(text: str) -> ast.expr:
    """Parse an expression to its syntax tree. Raises ImportProblemError for an empty, too long or invalid one."""
    if not text.strip():
        raise ImportProblemError("the expression is empty")
    if len(text) > LONGEST_EXPRESSION:
        raise ImportProblemError(f"the expression has {len(text)} characters; up to {LONGEST_EXPRESSION} are read")
    try:
        return ast.parse(text.strip(), mode="eval").body
    except (SyntaxError, ValueError, MemoryError, RecursionError) as error:
        raise ImportProblemError(f"'{text}' is not an expression ({_describe_error(error)}); {ALLOWED}") from error


class _Evaluation:
    """Evaluation of one expression. Its methods may raise ImportProblemError."""

    def __init__(self, text: str, lookup: Lookup, clock: Clock, budget: Budget) -> None:
        self.text = text
        self.lookup = lookup
        self.clock = clock
        self.budget = budget

    def evaluate_node(self, node: ast.expr) -> Any:
        """Evaluate a node of the syntax tree to numbers or a text."""
        with self.budget.enter_nesting(self.text):
            match node:
                case ast.Constant() | ast.Name():
                    return self._evaluate_leaf(node)
                case ast.UnaryOp(op=ast.USub(), operand=operand):
                    return self._negate_operand(operand)
                case ast.UnaryOp(op=ast.UAdd(), operand=operand):
                    return self._evaluate_numbers(operand)
                case ast.BinOp(left=left_operand, op=operator, right=right_operand) if type(operator) in _OPERATIONS:
                    return self._combine_operands(_OPERATIONS[type(operator)], left_operand, right_operand)
                case ast.Compare(left=left_operand, ops=[order], comparators=[right_operand]) if (
                    type(order) in _COMPARISONS
                ):
                    return self._combine_operands(_COMPARISONS[type(order)], left_operand, right_operand)
                case ast.Call(func=ast.Name(id=name), args=arguments, keywords=[]):
                    return self._call_function(name, arguments)
                case ast.Subscript(value=operand, slice=index):
                    return self._index_array(operand, index)
            raise self._make_not_allowed_error(node)

    def _evaluate_leaf(self, node: ast.Constant | ast.Name) -> Any:
        """Evaluate a name, a number or a text. Other constants, such as booleans, and numbers from 1e300 on, are
        refused."""
        self.budget.spend(0, self.text)
        match node:
            case ast.Name(id="pi"):
                return np.float64(np.pi)
            case ast.Name(id=name):
                return self.lookup(name)
            case ast.Constant(value=str() as quoted_text):
                return quoted_text
            case ast.Constant(value=int() | float() as number) if not isinstance(number, bool) and abs(number) < 1e300:
                return np.float64(number)
        raise self._make_not_allowed_error(node)

    def _evaluate_numbers(self, node: ast.expr) -> Value:
        """Evaluate a node that must be numbers."""
        value = self.evaluate_node(node)
        if isinstance(value, str):
            raise ImportProblemError(f"in '{self.text}' the text '{value}' is found where numbers are needed")
        numbers: Value = value
        return numbers

    def _negate_operand(self, node: ast.expr) -> Value:
        """Evaluate a node with a minus sign."""
        value = self._evaluate_numbers(node)
        self.budget.spend(np.size(value), self.text)
        return np.negative(value)

    def _combine_operands(
        self, operation: Callable[[Any, Any], Any], left_operand: ast.expr, right_operand: ast.expr
    ) -> Value:
        """Evaluate an operator or comparison between two nodes."""
        first = self._evaluate_numbers(left_operand)
        with self.budget.hold_numbers(np.size(first)):
            second = self._evaluate_numbers(right_operand)
        try:
            self._count_cost((first, second), 1)
            return np.asarray(operation(first, second), dtype=np.float64)
        except ImportProblemError:
            raise
        except ValueError as error:
            raise ImportProblemError(
                f"in '{self.text}' arrays of the shapes {np.shape(first)} and {np.shape(second)} cannot be combined"
            ) from error

    def _count_cost(self, values: Sequence[Value], cost_per_number: int) -> None:
        """Count the cost of an elementwise operation on these values. Raises ValueError if their shapes do not fit."""
        size = math.prod(np.broadcast_shapes(*(np.shape(value) for value in values)))
        with self.budget.hold_numbers(sum(np.size(value) for value in values)):
            self.budget.spend(size, self.text, cost_per_number)

    def _call_function(self, name: str, arguments: list[ast.expr]) -> Value:
        """Evaluate a function call; its cost is counted before it is computed."""
        if name == "array":
            return self._look_up_array(arguments)
        if name not in FUNCTIONS:
            raise ImportProblemError(
                f"in '{self.text}' there is no function '{name}'{suggest_name(name, FUNCTIONS)}; {ALLOWED}"
            )
        function = FUNCTIONS[name]
        if not function.min_arguments <= len(arguments) <= function.max_arguments:
            raise ImportProblemError(f"in '{self.text}' {function.usage} was given {len(arguments)} values")
        values: list[Value] = []
        for argument in arguments:
            with self.budget.hold_numbers(sum(np.size(value) for value in values)):
                values.append(self._evaluate_numbers(argument))
        try:
            if name == "repeat":
                self.budget.spend(np.size(values[0]) * float(values[1]), self.text)
            else:
                self._count_cost(values, _CALL_COST)
            return np.asarray(function.call(self.clock, *values), dtype=np.float64)
        except ImportProblemError:
            raise
        except (ValueError, IndexError, TypeError, ArithmeticError) as error:
            raise ImportProblemError(f"in '{self.text}' {function.usage} fails: {error}") from error

    def _look_up_array(self, arguments: list[ast.expr]) -> Value:
        """Evaluate `array("NAME")`, for names that are not identifiers."""
        match arguments:
            case [ast.Constant(value=str() as name)]:
                return self.lookup(name)
        raise ImportProblemError(f"in '{self.text}' array(\"NAME\") takes one name in quotes")

    def _index_array(self, operand: ast.expr, index: ast.expr) -> Value:
        """Evaluate an indexed array."""
        array = self._evaluate_numbers(operand)
        entries = index.elts if isinstance(index, ast.Tuple) else [index]
        indices: list[int | slice] = []
        with self.budget.hold_numbers(np.size(array)), self.budget.enter_nesting(self.text):
            for entry in entries:
                indices.append(self._evaluate_index(entry))
        try:
            part: npt.NDArray[np.float64] = np.asarray(array)[tuple(indices)]
        except IndexError as error:
            raise ImportProblemError(f"in '{self.text}' the index is outside the shape {np.shape(array)}") from error
        return part

    def _evaluate_index(self, node: ast.expr) -> int | slice:
        """Evaluate an index or a slice to integers."""
        if not isinstance(node, ast.Slice):
            return self._evaluate_integer(node)
        bounds = [
            None if bound is None else self._evaluate_integer(bound) for bound in (node.lower, node.upper, node.step)
        ]
        if bounds[2] == 0:
            raise ImportProblemError(f"in '{self.text}' a step of 0 is not allowed")
        return slice(*bounds)

    def _evaluate_integer(self, node: ast.expr) -> int:
        """Evaluate a node that must be an integer."""
        number = self._evaluate_numbers(node)
        if np.ndim(number) or not float(number).is_integer():
            raise ImportProblemError(f"in '{self.text}' an index is not a whole number")
        return int(number)

    def _make_not_allowed_error(self, node: ast.expr) -> ImportProblemError:
        """Make the error for a node that is not allowed."""
        # As written in the source: unparsing would need memory in proportion to its depth.
        part = ast.get_source_segment(self.text.strip(), node) or self.text
        return ImportProblemError(f"in '{self.text}' this is not understood: {part}; {ALLOWED}")


def _describe_error(error: BaseException) -> str:
    """Describe a syntax error by its message, any other exception by the name of its class."""
    return error.msg if isinstance(error, SyntaxError) else type(error).__name__
