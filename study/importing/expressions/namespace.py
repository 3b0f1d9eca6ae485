"""Values of names in an expression: arrays of a file, and definitions ([let]) of the map. `build_recording` makes a
namespace for each file."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import numpy.typing as npt

from study.importing.arrays.csv_arrays import FaultyColumn
from study.importing.arrays.mat_arrays import suggest_conversion
from study.importing.arrays.read_arrays import Arrays, find_unread_reason
from study.importing.expressions.budget import Budget
from study.importing.expressions.expression import evaluate
from study.importing.expressions.functions import Clock, Value
from study.importing.map_format.map_errors import ImportProblemError, suggest_name
from study.importing.map_format.signal_words import split_bracketed_unit

_MAX_LISTED_ARRAYS = 24
"""Most arrays that a message names."""


@dataclass(frozen=True, slots=True)
class NoTime:
    """Clock of the expressions that define a rate or time stamps, for which no time is known yet."""

    def times_s(self, count: int) -> Value:
        """Raises ValueError, because no time is known."""
        raise ValueError("there is no clock in this place yet")


@dataclass(frozen=True, slots=True, eq=False)
class Namespace:
    """Names of one file, as seen from one part of the map."""

    arrays: Mapping[str, npt.NDArray[Any]]
    definitions: Mapping[str, str]
    file_name: str
    """The file, for messages."""
    budget: Budget
    """Limit of the cost of all expressions of an import together."""
    _open_definitions: set[str] = field(default_factory=set)
    """Definitions that are being evaluated: a recursive definition is refused."""

    def compute_value(self, text: str, clock: Clock) -> Value:
        """Value of an array by its name, which may contain any characters, or of an expression. Raises
        ImportProblemError."""
        if text in self.arrays:
            return self._convert_to_float(text)
        return evaluate(text, lambda name: self.look_up_value(name, clock), clock, self.budget)

    def compute_number(self, text: str) -> float:
        """Value of an expression that must be a single finite number. Raises ImportProblemError otherwise."""
        value = self.compute_value(text, NoTime())
        if np.size(value) != 1 or not np.isfinite(value).all():
            raise ImportProblemError(f"'{text}' has the shape {np.shape(value)}; it must be one number")
        return float(np.ravel(value)[0])

    def look_up_value(self, name: str, clock: Clock) -> Value:
        """Value of an array or a definition. clock: gives the times for the expression of a definition. Raises
        ImportProblemError for an unknown name."""
        if name in self.arrays:
            return self._convert_to_float(name)
        if name in self.definitions:
            return self._evaluate_definition(name, clock)
        if name == "clock_s":
            raise ImportProblemError("clock_s is known in [[computed]] channels only, on the recording's grid")
        names = [*self.arrays, *self.definitions]
        raise ImportProblemError(
            f"there is no array '{name}' in {self.file_name}{suggest_name(name, names)}; there are {self.list_names()}"
        )

    def has_name(self, name: str) -> bool:
        """Whether there is an array or a definition of this name."""
        return name in self.arrays or name in self.definitions

    def list_names(self) -> str:
        """Names with their shapes, for messages."""
        array_texts = [
            f"{name} {_describe_shape(array)}" for name, array in list(self.arrays.items())[:_MAX_LISTED_ARRAYS]
        ]
        unlisted_count = len(self.arrays) - _MAX_LISTED_ARRAYS
        return ", ".join(array_texts) + (f" and {unlisted_count} more" if unlisted_count > 0 else "")

    def _evaluate_definition(self, name: str, clock: Clock) -> Value:
        """Value of a definition of the map. Raises ImportProblemError for a recursive definition."""
        if name in self._open_definitions:
            raise ImportProblemError(f"the definition of '{name}' refers to itself")
        self._open_definitions.add(name)
        try:
            with self.budget.enter_nesting(name, 2):
                return self.compute_value(self.definitions[name], clock)
        finally:
            self._open_definitions.discard(name)

    def _convert_to_float(self, name: str) -> Value:
        """An array as float64. Raises ImportProblemError where it holds no real numbers."""
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
    """Namespace of a file. Names that begin with the prefix are also known without it, and `fx [N]` as `fx`. Raises
    ImportProblemError if a prefix is given and no name begins with it."""
    unprefixed = {name.removeprefix(prefix): array for name, array in arrays.by_name.items() if name.startswith(prefix)}
    unitless = {split_bracketed_unit(name)[0]: array for name, array in arrays.by_name.items()}
    if prefix and not unprefixed:
        names_text = Namespace(arrays.by_name, {}, arrays.name, budget).list_names()
        raise ImportProblemError(f"no array of {arrays.name} begins with '{prefix}'; there are {names_text}")
    budget.add_allowance(sum(array.size for array in arrays.by_name.values()))
    return Namespace({**unitless, **arrays.by_name, **unprefixed}, definitions, arrays.name, budget)


def _describe_shape(array: npt.NDArray[Any]) -> str:
    """Shape of an array in words."""
    if array.dtype.kind not in "fiub":
        return "(no numbers)"
    return "(a number)" if array.ndim == 0 else f"({' x '.join(str(count) for count in array.shape)})"
