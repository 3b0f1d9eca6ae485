"""Time limits of a search. A search that reaches its limit ends with what it has found so far."""

from collections.abc import Callable, Iterable
from functools import wraps
from itertools import count

from analysis.diagnosis.types import Mapper, TimeBudget

OUT_OF_TIME = (
    "The time limit of the search was reached: a further effect, or a better fit of the last one, was not searched for."
)


class OutOfTimeError(Exception):
    """Raised within the search where the time is over, and caught by it."""


def always() -> bool:
    """A `TimeBudget` without a limit."""
    return True


class CountedBudget:
    """A `TimeBudget` that ends after a number of calls, so that the same work is done on every machine."""

    def __init__(self, most: int) -> None:
        """most: number of calls that return True."""
        self._most, self._asked = most, count()

    def __call__(self) -> bool:
        return next(self._asked) < self._most


def limit_map(map_: Mapper, time_left: TimeBudget) -> Mapper:
    """The map with a time limit; it raises OutOfTimeError before a piece of work that would begin after the limit.

    Pieces may run in other processes, which have copies of the budget. The calls made there are returned with the
    results, and a `CountedBudget` is called as often again here, so that each call counts once. A clock is not called
    again: pieces that began in time are kept, however late they end.
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
