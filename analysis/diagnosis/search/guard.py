"""Crash isolation: an effect or a piece of work that crashes is left out of the search, and the answer says so.

The guard is off by default, and exceptions then propagate: tests, benchmarks and banks must see every crash.
"""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field
from functools import wraps
from typing import Any, TypeVar

from analysis.diagnosis.effect_words import noun_of
from analysis.diagnosis.errors.hypothesis import Hypothesis
from analysis.diagnosis.search.time_budget import OutOfTimeError
from analysis.diagnosis.types import Mapper
from analysis.wording import capitalise, conjoin
from equalizer.effects.effect import Effect

Result = TypeVar("Result")


@dataclass(frozen=True, slots=True)
class Crash:
    """An exception that was caught."""

    what: str
    """Name of the effect that crashed, or the piece of work in words."""
    doing: str
    """The step at which it crashed, in words: "its fit"."""
    said: str
    """Class and message of the exception."""


@dataclass(frozen=True, slots=True, eq=False)
class Part:
    """A piece of the work that can be left out."""

    what: str
    """Name of an effect, or the piece of work in words."""
    doing: str
    """The step, in words."""
    work: Callable[[], Any]
    instead: Any
    """The result that replaces that of `work` if `work` crashes."""


@dataclass(frozen=True, slots=True, eq=False)
class Guard:
    """Runs work so that a crash is noted and its result left out or replaced; while it is off, exceptions propagate.

    OutOfTimeError always propagates: it is no crash.
    """

    on: bool = False
    crashes: list[Crash] = field(default_factory=list)
    """Crashes caught so far."""

    def over(self, map_: Mapper, doing: str) -> Mapper:
        """A map over effects, hypotheses or fits that notes crashes and leaves out the results of the items that
        crashed. doing: the step, in words."""
        if not self.on:
            return map_

        def guarded_map(function: Callable[..., object], items: Iterable[object]) -> Iterable[object]:
            @wraps(function)
            def guard_item(item: object) -> tuple[object, ...] | Crash:
                return _try(_effect_of(item), doing, lambda: function(item))

            results: list[tuple[object, ...] | Crash] = list(map_(guard_item, items))  # type: ignore[arg-type]
            # Crashes are noted here and not in `guard_item`, which may run in another process.
            self.crashes.extend(found for found in results if isinstance(found, Crash))
            return [result for found in results if not isinstance(found, Crash) for result in found]

        return guarded_map

    def part(
        self,
        what: str,
        doing: str,
        work: Callable[[], Result],
        instead: Result,
        passed_on: tuple[type[Exception], ...] = (),
    ) -> Result:
        """The result of a piece of work, or `instead` where it crashes. what, doing: as in `Part`. passed_on:
        exceptions that are meant for the user and propagate."""
        found = _try(what, doing, work, passed_on) if self.on else (work(),)
        if isinstance(found, Crash):
            self.crashes.append(found)
            return instead
        return found[0]

    def parts(self, map_: Mapper, pieces: Sequence[Part]) -> list[Any]:
        """The results of independent pieces of work, in their order; `Part.instead` for each that crashed."""

        def try_part(piece: Part) -> tuple[Any] | Crash:
            return _try(piece.what, piece.doing, piece.work) if self.on else (piece.work(),)

        results: list[tuple[Any] | Crash] = list(map_(try_part, pieces))  # type: ignore[arg-type]
        self.crashes.extend(found for found in results if isinstance(found, Crash))
        return [
            piece.instead if isinstance(found, Crash) else found[0]
            for piece, found in zip(pieces, results, strict=True)
        ]

    @property
    def sentences(self) -> tuple[str, ...]:
        """A sentence per effect or piece of work that crashed, with the steps and the exceptions."""
        return tuple(_sentence(what, self.crashes) for what in dict.fromkeys(crash.what for crash in self.crashes))


def _try(
    what: str, doing: str, work: Callable[[], Result], passed_on: tuple[type[Exception], ...] = ()
) -> tuple[Result] | Crash:
    """The result in a tuple, or the crash. Raises OutOfTimeError, and the exceptions of `passed_on`."""
    try:
        return (work(),)
    except OutOfTimeError:
        raise
    except Exception as crash:
        if isinstance(crash, passed_on):
            raise
        return Crash(what, doing, f"{type(crash).__name__}: {crash}".rstrip(": ."))


def _sentence(what: str, crashes: Iterable[Crash]) -> str:
    own = list(dict.fromkeys((crash.doing, crash.said) for crash in crashes if crash.what == what))
    noun = noun_of(what)
    name = noun if what in noun or noun == what.replace("_", " ") else f"{noun} ({what})"
    at = conjoin([f"{doing} ({said})" for doing, said in own])
    return f"{capitalise(name)} was left out because of a program error at {at}: the result was obtained without it."


def _effect_of(item: object) -> str:
    """Name of the newest effect of an effect, a hypothesis or a fit."""
    if isinstance(item, Effect):
        return item.name
    hypothesis = item if isinstance(item, Hypothesis) else getattr(item, "hypothesis", None)
    claims = () if hypothesis is None else hypothesis.claims
    return claims[-1].effect.name if claims else "the model's own parameters"
