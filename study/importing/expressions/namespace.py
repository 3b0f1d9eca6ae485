"""Look up the names in the expressions of an import map: arrays of a file, and definitions ([let]) of the map."""

import unicodedata
from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import numpy.typing as npt

from study.importing.arrays.csv_arrays import FaultyColumn
from study.importing.arrays.mat_arrays import suggest_conversion
from study.importing.arrays.read_arrays import Arrays, find_unread_reason
from study.importing.arrays.table_cells import is_unit
from study.importing.expressions.budget import Budget
from study.importing.expressions.expression import evaluate
from study.importing.expressions.functions import FUNCTIONS, Clock, Value
from study.importing.map_format.map_errors import ImportProblemError, suggest_name
from study.importing.map_format.signal_words import split_bracketed_unit

_MAX_LISTED_ARRAYS = 24
"""Maximum number of arrays that a message names. Chosen."""


@dataclass(frozen=True, slots=True)
class NoTime:
    """`Clock` for the expressions that define a rate or time stamps: no time is known yet."""

    def times_s(self, count: int) -> Value:
        """Raise ValueError, because no time is known."""
        raise ValueError("there is no clock in this place yet")


@dataclass(frozen=True, slots=True, eq=False)
class Namespace:
    """Names that the expressions of one part of the map can use for one file. An array has precedence over a definition
    of the same name."""

    arrays: Mapping[str, npt.NDArray[Any]]
    """Arrays by name."""
    definitions: Mapping[str, str]
    """Expressions of [let] by name."""
    file_name: str
    """Name of the file, for messages."""
    budget: Budget
    """Limit of the cost of all expressions of an import together."""
    _open_definitions: set[str] = field(default_factory=set)
    """Names of the definitions that are being evaluated: a recursive definition is refused."""

    def compute_value(self, expression: str, clock: Clock) -> Value:
        """Compute a value that the map states: the array whose exact name `expression` is (it may contain any
        characters), else the value of the expression. clock: gives the times for it. Raises ImportProblemError where it
        cannot be computed."""
        if (name := self._resolve_name(expression)) in self.arrays:
            return self._convert_to_float(name)
        stem, unit = split_bracketed_unit(expression)
        if unit != "1" and is_unit(unit) and stem not in FUNCTIONS:
            index_name = self._resolve_name(expression.strip().removeprefix(stem).strip("[]() "))  # as it is written
            if not self.has_name(index_name):
                raise self._make_unknown_error(expression)  # a name with its unit, not an index or an argument
        return evaluate(expression, lambda name: self.look_up_value(name, clock), clock, self.budget)

    def compute_number(self, expression: str) -> float:
        """Compute the value of an expression that must be a single finite number, without a time. Raises
        ImportProblemError otherwise."""
        value = self.compute_value(expression, NoTime())
        if np.size(value) != 1 or not np.isfinite(value).all():
            raise ImportProblemError(f"'{expression}' has the shape {np.shape(value)}; it must be one finite number")
        return float(np.ravel(value)[0])

    def look_up_value(self, name: str, clock: Clock) -> Value:
        """Look up the value of an array or a definition. clock: gives the times for the expression of a definition.
        Raises ImportProblemError for an unknown name, and for a value that cannot be computed."""
        name = self._resolve_name(name)
        if name in self.arrays:
            return self._convert_to_float(name)
        if name in self.definitions:
            return self._evaluate_definition(name, clock)
        if name == "clock_s":
            raise ImportProblemError("clock_s is known in [[computed]] channels only, on the recording's grid")
        raise self._make_unknown_error(name)

    def _make_unknown_error(self, name: str) -> ImportProblemError:
        """Make the error for an unknown name."""
        names = [*self.arrays, *self.definitions]
        return ImportProblemError(
            f"there is no array '{name}' in {self.file_name}{suggest_name(name, names)}; there are {self.list_names()}"
        )

    def has_name(self, name: str) -> bool:
        """Whether there is an array or a definition of this name."""
        return name in self.arrays or name in self.definitions

    def _resolve_name(self, name: str) -> str:
        """Find the name of an array or a definition that is written with other code points for the same letters: the
        parser changes `µ` (U+00B5) in an expression to the Greek letter. `x2` is not `x²`, which is no identifier.
        Unchanged without such a name."""
        if self.has_name(name):
            return name
        normal_form = unicodedata.normalize("NFKC", name)
        is_identifier = name.isidentifier()
        known_names = (known for known in (*self.arrays, *self.definitions) if known.isidentifier() == is_identifier)
        return next((known for known in known_names if unicodedata.normalize("NFKC", known) == normal_form), name)

    def list_names(self) -> str:
        """List the names of the first `_MAX_LISTED_ARRAYS` arrays with their shapes, and how many more there are, for
        messages."""
        array_texts = [
            f"{name} {_describe_shape(array)}" for name, array in list(self.arrays.items())[:_MAX_LISTED_ARRAYS]
        ]
        unlisted_count = len(self.arrays) - _MAX_LISTED_ARRAYS
        return ", ".join(array_texts) + (f" and {unlisted_count} more" if unlisted_count > 0 else "")

    def _evaluate_definition(self, name: str, clock: Clock) -> Value:
        """Compute the value of a definition of the map. Raises ImportProblemError for a recursive definition, or where
        it cannot be computed."""
        if name in self._open_definitions:
            raise ImportProblemError(f"the definition of '{name}' refers to itself")
        self._open_definitions.add(name)
        try:
            with self.budget.enter_nesting(name, 2):
                return self.compute_value(self.definitions[name], clock)
        finally:
            self._open_definitions.discard(name)

    def _convert_to_float(self, name: str) -> Value:
        """Convert an array to float64, at a cost of its size. Raises ImportProblemError where it holds no real
        numbers."""
        array = self.arrays[name]
        problem = find_unread_reason(array)
        if isinstance(problem, FaultyColumn):
            raise ImportProblemError(problem)
        if array.dtype.kind not in "fiub":
            content = "complex numbers" if array.dtype.kind == "c" else "text or objects"
            kind_text = f": it is {problem}" if problem else ""
            advice = f"; {statement}" if (statement := suggest_conversion(name, problem)) else ""
            raise ImportProblemError(
                f"the array '{name}' in {self.file_name} holds {content}, not real numbers{kind_text}{advice}"
            )
        self.budget.spend(array.size, name)
        with np.errstate(all="ignore"):
            return np.asarray(array, dtype=np.float64)


def make_namespace(arrays: Arrays, definitions: Mapping[str, str], prefix: str, budget: Budget) -> Namespace:
    """Make the namespace of a file. Names that begin with the prefix are also known without it, or without their unit
    (`fx [N]` as `fx`, unless there is an `fx` in another unit), but not without both. Of equal names, that without the
    prefix has precedence, then the name in the file, then that without the unit. The budget is extended by the number
    of values of the file. Raises ImportProblemError if a prefix is given and no name begins with it."""
    unprefixed = {name.removeprefix(prefix): array for name, array in arrays.by_name.items() if name.startswith(prefix)}
    stems = {name: split_bracketed_unit(name)[0] for name in arrays.by_name}
    stem_counts = Counter(stems.values())
    unitless = {stems[name]: array for name, array in arrays.by_name.items() if stem_counts[stems[name]] == 1}
    if prefix and not unprefixed:
        names_text = Namespace(arrays.by_name, {}, arrays.name, budget).list_names()
        raise ImportProblemError(f"no array of {arrays.name} begins with '{prefix}'; there are {names_text}")
    budget.add_allowance(sum(array.size for array in arrays.by_name.values()))
    return Namespace({**unitless, **arrays.by_name, **unprefixed}, definitions, arrays.name, budget)


def _describe_shape(array: npt.NDArray[Any]) -> str:
    """Describe the shape of an array: "(100 x 3)", "(a number)", or "(no numbers)" for texts, complex numbers and
    objects."""
    if array.dtype.kind not in "fiub":
        return "(no numbers)"
    return "(a number)" if array.ndim == 0 else f"({' x '.join(str(count) for count in array.shape)})"
