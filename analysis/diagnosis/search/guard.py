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

    subject: str
    """Name of the effect that crashed, or the piece of work in words."""
    step: str
    """The step at which it crashed, in words: "its fit"."""
    message: str
    """Class and message of the exception."""


@dataclass(frozen=True, slots=True, eq=False)
class Part:
    """A piece of the work that can be left out."""

    subject: str
    """Name of an effect, or the piece of work in words."""
    step: str
    """The step, in words."""
    work: Callable[[], Any]
    substitute: Any
    """The result that replaces that of `work` if `work` crashes."""


@dataclass(frozen=True, slots=True, eq=False)
class Guard:
    """Runs work so that a crash is noted and its result left out or replaced; while it is off, exceptions propagate.

    OutOfTimeError always propagates: it is no crash.
    """

    on: bool = False
    crashes: list[Crash] = field(default_factory=list)
    """Crashes caught so far."""

    def wrap(self, map_: Mapper, step: str) -> Mapper:
        """A map over effects, hypotheses or fits that notes crashes and leaves out the results of the items that
        crashed. step: in words."""
        if not self.on:
            return map_

        def guarded_map(function: Callable[..., object], items: Iterable[object]) -> Iterable[object]:
            @wraps(function)
            def guard_item(item: object) -> tuple[object, ...] | Crash:
                return _try(_find_effect_name(item), step, lambda: function(item))

            results: list[tuple[object, ...] | Crash] = list(map_(guard_item, items))  # type: ignore[arg-type]
            # Crashes are noted here and not in `guard_item`, which may run in another process.
            self.crashes.extend(outcome for outcome in results if isinstance(outcome, Crash))
            return [result for outcome in results if not isinstance(outcome, Crash) for result in outcome]

        return guarded_map

    def run(
        self,
        subject: str,
        step: str,
        work: Callable[[], Result],
        substitute: Result,
        propagated: tuple[type[Exception], ...] = (),
    ) -> Result:
        """The result of a piece of work, or `substitute` where it crashes. subject, step: `what` and `doing` of a
        `Part`. propagated: exceptions that are meant for the user and propagate."""
        outcome = _try(subject, step, work, propagated) if self.on else (work(),)
        if isinstance(outcome, Crash):
            self.crashes.append(outcome)
            return substitute
        return outcome[0]

    def run_parts(self, map_: Mapper, work_parts: Sequence[Part]) -> list[Any]:
        """The results of independent pieces of work, in their order; `Part.substitute` for each that crashed."""

        def try_part(work_part: Part) -> tuple[Any] | Crash:
            return _try(work_part.subject, work_part.step, work_part.work) if self.on else (work_part.work(),)

        results: list[tuple[Any] | Crash] = list(map_(try_part, work_parts))  # type: ignore[arg-type]
        self.crashes.extend(outcome for outcome in results if isinstance(outcome, Crash))
        return [
            work_part.substitute if isinstance(outcome, Crash) else outcome[0]
            for work_part, outcome in zip(work_parts, results, strict=True)
        ]

    @property
    def sentences(self) -> tuple[str, ...]:
        """A sentence per effect or piece of work that crashed, with the steps and the exceptions."""
        return tuple(
            _describe_crashes(subject, self.crashes)
            for subject in dict.fromkeys(crash.subject for crash in self.crashes)
        )


def _try(
    subject: str, step: str, work: Callable[[], Result], propagated: tuple[type[Exception], ...] = ()
) -> tuple[Result] | Crash:
    """The result in a tuple, or the crash. Raises OutOfTimeError, and those of `propagated`."""
    try:
        return (work(),)
    except OutOfTimeError:
        raise
    except Exception as crash:
        if isinstance(crash, propagated):
            raise
        return Crash(subject, step, f"{type(crash).__name__}: {crash}".rstrip(": ."))


def _describe_crashes(subject: str, crashes: Iterable[Crash]) -> str:
    steps_and_errors = list(dict.fromkeys((crash.step, crash.message) for crash in crashes if crash.subject == subject))
    noun = noun_of(subject)
    name = noun if subject in noun or noun == subject.replace("_", " ") else f"{noun} ({subject})"
    places = conjoin([f"{step} ({message})" for step, message in steps_and_errors])
    return (
        f"{capitalise(name)} was left out because of a program error at {places}: the result was obtained without it."
    )


def _find_effect_name(item: object) -> str:
    """Name of the newest effect of an effect, a hypothesis or a fit."""
    if isinstance(item, Effect):
        return item.name
    hypothesis = item if isinstance(item, Hypothesis) else getattr(item, "hypothesis", None)
    claims = () if hypothesis is None else hypothesis.claims
    return claims[-1].effect.name if claims else "the model's own parameters"
