"""Time limits of a search; what was found until then is the result."""

from collections.abc import Callable, Iterable
from functools import wraps
from itertools import count

from analysis.diagnosis.types import Mapper, TimeBudget

OUT_OF_TIME = (
    "The time for the search ran out before it was done: a further effect, or a better fit of the last one, was not "
    "looked for."
)


class OutOfTimeError(Exception):
    """Raised within the search, and caught by it."""


def always() -> bool:
    """A `TimeBudget` without a limit."""
    return True


class CountedBudget:
    """A TimeBudget that ends after so many questions, so that the same work is done on every machine."""

    def __init__(self, most: int) -> None:
        self._most, self._asked = most, count()

    def __call__(self) -> bool:
        return next(self._asked) < self._most


def limit_map(map_: Mapper, time_left: TimeBudget) -> Mapper:
    """The same map; raises OutOfTimeError before a piece of work that would begin after the time limit.

    Where pieces are worked on in other processes, a count is asked here again, for what was asked there: each counts
    once. A clock is not: pieces that began in time are kept, however late they are done.
    """
    asked = [0]

    def ask() -> None:
        asked[0] += 1
        if not time_left():
            raise OutOfTimeError

    def timed_map(function: Callable[..., object], *items: Iterable[object]) -> Iterable[object]:
        begun = asked[0]

        @wraps(function)
        def work(*arguments: object) -> tuple[object, int]:
            before = asked[0]
            ask()
            return function(*arguments), asked[0] - before

        found: list[tuple[object, int]] = list(map_(work, *items))  # type: ignore[arg-type]
        elsewhere = sum(times for _, times in found) - (asked[0] - begun)
        if isinstance(time_left, CountedBudget):
            for _ in range(elsewhere):
                ask()
        else:
            asked[0] += elsewhere
        return [result for result, _ in found]

    return timed_map
