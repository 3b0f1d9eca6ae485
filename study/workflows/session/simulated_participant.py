"""A simulated participant as a person who can sit down: display, hand and virtual time in one."""

from collections.abc import Callable

from study.devices.clock import Clock
from study.participants.observer import Observer
from study.participants.observers import observer_named
from study.session.views.views import Question
from study.workflows.session.conduct_session import Participant
from study.workflows.session.simulated_display import SimulatedDisplay


def simulated_participant(
    name: str, seed: int, clock: Clock, on_question: Callable[[Question], None] | None = None
) -> Participant:
    """By the name that the command line and the log use. Raises StudyError for an unknown name."""
    return seated(observer_named(name, seed), seed, clock, on_question)


def seated(
    observer: Observer, seed: int, clock: Clock, on_question: Callable[[Question], None] | None = None
) -> Participant:
    display = SimulatedDisplay(observer, seed, clock, on_question)
    return Participant(display=display, hand=display, clock=clock)
