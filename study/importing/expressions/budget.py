"""Limits of the cost of a map's expressions: array elements held at once, elements computed in total, nesting depth.

A definition may use another one twice, and that one a third one twice: a chain of 40 such definitions computes 2^40,
about 10^12, values, although the map is short. Therefore the cost is counted during evaluation, not estimated from the
text.
"""

from collections.abc import Iterator
from contextlib import contextmanager

from study.importing.map_format.map_errors import ImportProblemError

MAX_EXPRESSION_DEPTH = 200
"""Largest nesting depth of an expression, with the definitions that it uses. Chosen: below Python's recursion limit."""
HELD_NUMBERS, HELD_PER_NUMBER = 20_000_000, 20
"""Number of array elements that may be held at once (64-bit: 160 MB), and addition to it for each number in the files.
Chosen."""
MAX_HELD_NUMBERS = 400_000_000
"""Upper limit of the numbers held at once, for files of any size (3.2 GB). Chosen."""
COMPUTED_NUMBERS, COMPUTED_PER_NUMBER = 500_000_000, 500
"""Total cost that an import may have, in additions of two numbers, and addition to it for each number in the files.
Chosen."""
_FIXED_OPERATION_COST = 10_000
"""Fixed cost of a single operation, in additions of two numbers. Chosen."""


class Budget:
    """Remaining allowance of one import: numbers held, cost, nesting depth."""

    def __init__(self) -> None:
        # `_held` and `_max_held`: array elements; `_remaining_cost`: additions of two numbers; `_depth`: levels.
        self._max_held = HELD_NUMBERS
        self._remaining_cost = COMPUTED_NUMBERS
        self._held = 0
        self._depth = 0

    def add_allowance(self, number_count: int) -> None:
        """Add the allowance for files that hold this many numbers."""
        self._max_held = min(MAX_HELD_NUMBERS, self._max_held + HELD_PER_NUMBER * number_count)
        self._remaining_cost += COMPUTED_PER_NUMBER * number_count

    def spend(self, number_count: float, expression: str, cost_per_number: int = 1) -> None:
        """Count the cost before an array of this many numbers is computed. expression: its text, for messages;
        cost_per_number: in additions. Raises ImportProblemError where a limit would be exceeded."""
        if self._held + number_count > self._max_held:
            raise ImportProblemError(f"'{expression}' would give more than {self._max_held} numbers")
        self._remaining_cost -= _FIXED_OPERATION_COST + cost_per_number * int(number_count)
        if self._remaining_cost < 0:
            raise ImportProblemError(
                f"'{expression}' takes too long: it and what it uses compute far more numbers than the file holds"
            )

    @contextmanager
    def hold_numbers(self, number_count: int) -> Iterator[None]:
        """Count a value of this many numbers as held in memory while the block runs."""
        self._held += number_count
        try:
            yield
        finally:
            self._held -= number_count

    @contextmanager
    def enter_nesting(self, expression: str, levels: int = 1) -> Iterator[None]:
        """Count levels of nesting while the block runs. expression: its text, for messages. Raises
        ImportProblemError beyond `MAX_EXPRESSION_DEPTH`."""
        self._depth += levels
        try:
            if self._depth > MAX_EXPRESSION_DEPTH:
                raise ImportProblemError(f"'{expression}' is nested too deeply")
            yield
        finally:
            self._depth -= levels
