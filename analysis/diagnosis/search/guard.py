"""Isolate crashes of the diagnosis: an effect or a task that raises an exception is left out, and the report says so.

A guard is disabled by default, and exceptions then propagate: tests, benchmarks and banks of simulated devices must see
every crash.
"""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field
from functools import wraps
from typing import Any, TypeVar

from analysis.diagnosis.effect_words import get_noun
from analysis.diagnosis.errors.hypothesis import Hypothesis
from analysis.diagnosis.search.time_budget import OutOfTimeError
from analysis.diagnosis.types import Mapper
from analysis.wording import capitalise, conjoin
from equalizer.effects.effect import Effect

Result = TypeVar("Result")
"""Type of the result of a guarded function."""


@dataclass(frozen=True, slots=True)
class Crash:
    """An exception that was caught."""

    subject: str
    """Name of the effect that crashed, or a noun phrase for the task, such as "the black box"."""
    step: str
    """Noun phrase for the step at which it crashed, such as "its fit"."""
    message: str
    """Class and message of the exception."""


@dataclass(frozen=True, slots=True, eq=False)
class WorkPart:
    """A task that can be left out."""

    subject: str
    """As in `Crash`; so is `step`."""
    step: str
    work: Callable[[], Any]
    """Function that computes the result of the task."""
    substitute: Any
    """The result of the task if `work` crashes."""


@dataclass(frozen=True, slots=True, eq=False)
class Guard:
    """Runs functions, records their exceptions, and leaves out or replaces the missing results; while the guard is
    disabled, exceptions propagate. OutOfTimeError always propagates: it is no crash."""

    enabled: bool = False
    crashes: list[Crash] = field(default_factory=list)
    """Crashes caught so far."""

    def wrap(self, map_: Mapper, step: str) -> Mapper:
        """Return a map over effects, hypotheses or fits that records crashes and leaves out the results of the items
        that crashed; `map_` itself while the guard is disabled. step: as in `Crash`."""
        if not self.enabled:
            return map_

        def guarded_map(function: Callable[..., object], items: Iterable[object]) -> Iterable[object]:
            @wraps(function)
            def guard_item(item: object) -> tuple[object, ...] | Crash:
                return _run_guarded(_find_subject(item), step, lambda: function(item))

            outcomes: list[tuple[object, ...] | Crash] = list(map_(guard_item, items))  # type: ignore[arg-type]
            # Crashes are recorded here and not in `guard_item`, which may run in another process.
            self.crashes.extend(outcome for outcome in outcomes if isinstance(outcome, Crash))
            return [result for outcome in outcomes if not isinstance(outcome, Crash) for result in outcome]

        return guarded_map

    def run(
        self,
        subject: str,
        step: str,
        work: Callable[[], Result],
        substitute: Result,
        propagated: tuple[type[Exception], ...] = (),
    ) -> Result:
        """Run `work`, and return its result, or `substitute` if it crashes. subject, step: as in `Crash`. propagated:
        exceptions that are not caught, because they are messages to the user."""
        outcome = _run_guarded(subject, step, work, propagated) if self.enabled else (work(),)
        if isinstance(outcome, Crash):
            self.crashes.append(outcome)
            return substitute
        return outcome[0]

    def run_parts(self, map_: Mapper, parts: Sequence[WorkPart]) -> list[Any]:
        """Run independent tasks, and return their results in order; `WorkPart.substitute` for each that crashed. map_:
        runs them, possibly in other processes."""

        def try_part(part: WorkPart) -> tuple[Any] | Crash:
            return _run_guarded(part.subject, part.step, part.work) if self.enabled else (part.work(),)

        outcomes: list[tuple[Any] | Crash] = list(map_(try_part, parts))  # type: ignore[arg-type]
        self.crashes.extend(outcome for outcome in outcomes if isinstance(outcome, Crash))
        return [
            part.substitute if isinstance(outcome, Crash) else outcome[0]
            for part, outcome in zip(parts, outcomes, strict=True)
        ]

    @property
    def sentences(self) -> tuple[str, ...]:
        """A sentence for each effect or task that crashed, with the steps and the exceptions."""
        return tuple(
            _describe_crashes(subject, self.crashes)
            for subject in dict.fromkeys(crash.subject for crash in self.crashes)
        )


def _run_guarded(
    subject: str, step: str, work: Callable[[], Result], propagated: tuple[type[Exception], ...] = ()
) -> tuple[Result] | Crash:
    """Run `work`; returns its result in a tuple, or the crash. Raises OutOfTimeError, and the exceptions of
    `propagated`."""
    try:
        return (work(),)
    except OutOfTimeError:
        raise
    except Exception as error:
        if isinstance(error, propagated):
            raise
        return Crash(subject, step, f"{type(error).__name__}: {error}".rstrip(": ."))


def _describe_crashes(subject: str, crashes: Iterable[Crash]) -> str:
    """Write the sentence for the user on all crashes of a subject. The name of an effect follows its noun in brackets
    where it does not already appear in it."""
    steps_and_errors = list(dict.fromkeys((crash.step, crash.message) for crash in crashes if crash.subject == subject))
    subject_noun = get_noun(subject)
    name = (
        subject_noun
        if subject in subject_noun or subject_noun == subject.replace("_", " ")
        else f"{subject_noun} ({subject})"
    )
    steps = conjoin([f"{step} ({message})" for step, message in steps_and_errors])
    return f"{capitalise(name)} was left out because of a program error at {steps}: the result was obtained without it."


def _find_subject(item: object) -> str:
    """Find the name of an effect, or of the latest effect of a hypothesis or a fit; without one, return a phrase for
    the message."""
    if isinstance(item, Effect):
        return item.name
    hypothesis = item if isinstance(item, Hypothesis) else getattr(item, "hypothesis", None)
    claims = () if hypothesis is None else hypothesis.claims
    return claims[-1].effect.name if claims else "the model's own parameters"
