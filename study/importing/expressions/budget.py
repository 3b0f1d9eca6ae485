"""What the expressions of a map may cost together: numbers held at once, numbers computed in all, and nesting.

A definition may use another twice, and that one a third twice: forty of these are a million million values, though
the map is short. So cost is counted while values are computed, and not guessed from the text.
"""

from collections.abc import Iterator
from contextlib import contextmanager

from study.importing.map_format.map_errors import ImportProblemError

DEEPEST = 200
"""Levels of one expression and of the definitions that it uses. Python itself allows some thousand calls."""
NUMBERS = 20_000_000
"""Held at once (160 MB), and 20 times as many as the files hold, but never more than LARGEST."""
LARGEST = 400_000_000
WORK = 500_000_000
"""Numbers computed in all (about 2 s), and 500 times as many as the files hold."""
_STEP = 10_000
"""What a single operation costs beside its numbers: the time of this many additions."""


class Budget:
    """Of one import. Methods raise ImportProblemError; text: the expression, for messages."""

    def __init__(self) -> None:
        self._most_numbers = NUMBERS
        self._work_left = WORK
        self._held = 0
        self._depth = 0

    def allow_for(self, numbers: int) -> None:
        """A file of so many numbers was read."""
        self._most_numbers = min(LARGEST, self._most_numbers + 20 * numbers)
        self._work_left += 500 * numbers

    def spend(self, numbers: float, text: str, times: int = 1) -> None:
        """Before an array of so many numbers is computed. times: what each costs, in additions."""
        if self._held + numbers > self._most_numbers:
            raise ImportProblemError(f"'{text}' would give more than {self._most_numbers} numbers")
        self._work_left -= _STEP + times * int(numbers)
        if self._work_left < 0:
            raise ImportProblemError(
                f"'{text}' takes too long: it and what it uses compute far more numbers than the file holds"
            )

    @contextmanager
    def hold_numbers(self, numbers: int) -> Iterator[None]:
        """While another value is computed, this one stays."""
        self._held += numbers
        try:
            yield
        finally:
            self._held -= numbers

    @contextmanager
    def deeper(self, text: str, levels: int = 1) -> Iterator[None]:
        self._depth += levels
        try:
            if self._depth > DEEPEST:
                raise ImportProblemError(f"'{text}' is nested too deeply")
            yield
        finally:
            self._depth -= levels
