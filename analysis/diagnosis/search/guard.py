"""Crash isolation: an effect that crashes is left out of the search, and the answer says so.

Off, as it is unless asked for, every crash is an error: so tests, benchmarks and banks see it.
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
    """A crash that was caught: what crashed, at what work, and the error's class and message."""

    what: str
    """An effect's name, or what else was tried, in words."""
    doing: str
    said: str


@dataclass(frozen=True, slots=True, eq=False)
class Part:
    """A piece of the work that can be left out."""

    what: str
    """An effect's name, or words."""
    doing: str
    work: Callable[[], Any]
    instead: Any
    """The result where it crashes."""


@dataclass(frozen=True, slots=True, eq=False)
class Guard:
    """Runs work so that a crash is noted and its result left out or replaced; when off, crashes are errors."""

    on: bool = False
    crashes: list[Crash] = field(default_factory=list)
    """Crashes caught so far."""

    def over(self, map_: Mapper, doing: str) -> Mapper:
        """A map over effects, hypotheses or fits that notes crashes and leaves their results out."""
        if not self.on:
            return map_

        def guarded_map(function: Callable[..., object], items: Iterable[object]) -> Iterable[object]:
            @wraps(function)
            def guard_item(item: object) -> tuple[object, ...] | Crash:
                return _try(_effect_of(item), doing, lambda: function(item))

            results: list[tuple[object, ...] | Crash] = list(map_(guard_item, items))  # type: ignore[arg-type]
            # Noted here, for it may have happened in another process.
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
        """The result of a piece of work, or `instead` where it crashes. what: an effect's name, or words. passed_on:
        exceptions that are meant for the user, and are raised."""
        found = _try(what, doing, work, passed_on) if self.on else (work(),)
        if isinstance(found, Crash):
            self.crashes.append(found)
            return instead
        return found[0]

    def parts(self, map_: Mapper, pieces: Sequence[Part]) -> list[Any]:
        """The results of independent pieces of work."""

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
        """One per effect, with what it crashed at and how."""
        return tuple(_sentence(what, self.crashes) for what in dict.fromkeys(crash.what for crash in self.crashes))


def _try(
    what: str, doing: str, work: Callable[[], Result], passed_on: tuple[type[Exception], ...] = ()
) -> tuple[Result] | Crash:
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
    return f"{capitalise(name)} was left out where the program crashed at {at}: this answer was found without it."


def _effect_of(item: object) -> str:
    """Name of the newest effect of an effect, a hypothesis or a fit."""
    if isinstance(item, Effect):
        return item.name
    hypothesis = item if isinstance(item, Hypothesis) else getattr(item, "hypothesis", None)
    claims = () if hypothesis is None else hypothesis.claims
    return claims[-1].effect.name if claims else "the model's own parameters"
