"""Time limit of a search: what was found until then is the result."""

from collections.abc import Callable, Iterable
from itertools import count

from analysis.diagnosis.types import Mapper, TimeBudget

OUT_OF_TIME = (
    "The time for the search ran out before it was done: a further effect, or a better fit of the last one, was not "
    "looked for."
)


class OutOfTimeError(Exception):
    """Raised within the search, and caught by it."""


def always() -> bool:
    return True


def counted(most: int) -> TimeBudget:
    """Until it was asked so often: the same pieces on every machine, however busy."""
    asked = count()
    return lambda: next(asked) < most


def budgeted(map_: Mapper, time_left: TimeBudget) -> Mapper:
    """The same map; raises OutOfTimeError before a piece of work that would begin after the time limit."""

    def asked(function: Callable[..., object]) -> Callable[..., object]:
        def work(*arguments: object) -> object:
            if not time_left():
                raise OutOfTimeError
            return function(*arguments)

        return work

    def mapped(function: Callable[..., object], *items: Iterable[object]) -> Iterable[object]:
        return list(map_(asked(function), *items))

    return mapped
