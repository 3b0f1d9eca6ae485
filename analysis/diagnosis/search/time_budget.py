"""Time limits of a search (`TimeBudget`). A search that reaches its limit returns its result so far."""

from collections.abc import Callable, Iterable
from functools import wraps
from itertools import count

from analysis.diagnosis.types import Mapper, TimeBudget

OUT_OF_TIME = (
    "The time limit of the search was reached: a further effect, or a better fit of the last one, was not searched for."
)
"""Remark in a result whose search reached its limit."""


class OutOfTimeError(Exception):
    """Raised and caught within a search, where its time limit is reached."""


def grant_time() -> bool:
    """Return True: a `TimeBudget` without a limit."""
    return True


class CountedBudget:
    """A `TimeBudget` that ends after a number of calls, so that the same work is done on every machine."""

    def __init__(self, limit: int) -> None:
        """limit: number of calls that return True."""
        self._limit, self._call_counter = limit, count()

    def __call__(self) -> bool:
        """Count the call; True for the first `limit` calls."""
        return next(self._call_counter) < self._limit


def limit_map(map_: Mapper, time_left: TimeBudget) -> Mapper:
    """Return the map with a time limit: a list of results, or OutOfTimeError where an item would begin after the limit.

    The items may run in other processes, which have copies of the budget. The number of their calls of the budget is
    returned with the results, and a `CountedBudget` is called as often again in this process, so that each call counts
    once; where that exceeds its limit, OutOfTimeError is raised too. A clock is not read again: results of items that
    began in time are kept, however late these end.
    """
    call_counter = [0]

    def check_time() -> None:
        call_counter[0] += 1
        if not time_left():
            raise OutOfTimeError

    def map_in_time(function: Callable[..., object], *items: Iterable[object]) -> Iterable[object]:
        calls_at_start = call_counter[0]

        @wraps(function)
        def call_in_time(*arguments: object) -> tuple[object, int]:
            calls_before = call_counter[0]
            check_time()
            return function(*arguments), call_counter[0] - calls_before

        outcomes: list[tuple[object, int]] = list(map_(call_in_time, *items))  # type: ignore[arg-type]
        worker_calls = sum(call_count for _, call_count in outcomes) - (call_counter[0] - calls_at_start)
        if isinstance(time_left, CountedBudget):
            for _ in range(worker_calls):
                check_time()
        else:
            call_counter[0] += worker_calls
        return [result for result, _ in outcomes]

    return map_in_time
