"""Limit of the cost of a map's expressions: array elements held at once, elements computed in total, and nesting.

A definition may use another twice, and that one a third twice: forty of these are 10^12 values, although the map is
short. Therefore the cost is counted during evaluation, not estimated from the text.
"""

from collections.abc import Iterator
from contextlib import contextmanager

from study.importing.map_format.map_errors import ImportProblemError

MAX_EXPRESSION_DEPTH = 200
"""Nesting of one expression and of the definitions that it uses; below Python's own recursion limit."""
HELD_NUMBERS, HELD_PER_NUMBER = 20_000_000, 20
"""Numbers that may be held at once (64-bit: 160 MB), and how many more for each number that the files hold. By hand."""
MAX_HELD = 400_000_000
"""Most numbers held at once, for any file (3.2 GB). By hand."""
COMPUTED_NUMBERS, COMPUTED_PER_NUMBER = 500_000_000, 500
"""Numbers that may be computed in total, and how many more for each number that the files hold. By hand."""
_STEP = 10_000
"""Fixed cost of a single operation, in additions. By hand."""


class Budget:
    """Budget of one import. Methods raise ImportProblemError; text: the expression, for messages."""

    def __init__(self) -> None:
        self._most_held = HELD_NUMBERS
        self._left_to_compute = COMPUTED_NUMBERS
        self._held = 0
        self._depth = 0

    def allow_for(self, numbers: int) -> None:
        """Add the allowance for a file of this many numbers."""
        self._most_held = min(MAX_HELD, self._most_held + HELD_PER_NUMBER * numbers)
        self._left_to_compute += COMPUTED_PER_NUMBER * numbers

    def spend(self, numbers: float, text: str, times: int = 1) -> None:
        """Count the cost before an array of this many numbers is computed. times: cost of each, in additions."""
        if self._held + numbers > self._most_held:
            raise ImportProblemError(f"'{text}' would give more than {self._most_held} numbers")
        self._left_to_compute -= _STEP + times * int(numbers)
        if self._left_to_compute < 0:
            raise ImportProblemError(
                f"'{text}' takes too long: it and what it uses compute far more numbers than the file holds"
            )

    @contextmanager
    def hold_numbers(self, numbers: int) -> Iterator[None]:
        """Count a value that is kept while another one is computed."""
        self._held += numbers
        try:
            yield
        finally:
            self._held -= numbers

    @contextmanager
    def nested(self, text: str, levels: int = 1) -> Iterator[None]:
        """Count levels of nesting while the block runs. Raises ImportProblemError beyond `MAX_EXPRESSION_DEPTH`."""
        self._depth += levels
        try:
            if self._depth > MAX_EXPRESSION_DEPTH:
                raise ImportProblemError(f"'{text}' is nested too deeply")
            yield
        finally:
            self._depth -= levels
