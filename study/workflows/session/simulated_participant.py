"""Make a simulated participant of a sitting: an observer model that implements the ports for display and hand.

An observer that depends on the delivered acceleration (`DeliveredFeeler`) also gets a `StimulusSampler`, which measures
that acceleration.
"""

from collections.abc import Callable

from study.devices.clock import Clock
from study.participants.delivered_feeler import DeliveredFeeler
from study.participants.observer import Observer
from study.participants.observer_catalogue import find_observer
from study.session.views.participant_views import Question
from study.workflows.session.conduct_session import Participant
from study.workflows.session.simulated_display import SimulatedDisplay
from study.workflows.session.stimulus_sampler import StimulusSampler


def make_simulated_participant(
    name: str, seed: int, clock: Clock, on_question: Callable[[Question], None] | None = None
) -> Participant:
    """Make the participant for an observer's name, as used on the command line and in the log. seed, on_question: as
    for `make_observer_participant`. Raises StudyError for an unknown name."""
    return make_observer_participant(find_observer(name, seed), seed, clock, on_question)


def make_observer_participant(
    observer: Observer, seed: int, clock: Clock, on_question: Callable[[Question], None] | None = None
) -> Participant:
    """Make the participant for an observer. seed: of the session, for the observer's random draws. on_question: called
    with each question before it is answered."""
    if not isinstance(observer, DeliveredFeeler):
        display = SimulatedDisplay(observer, seed, clock, on_question)
        return Participant(display=display, hand=display, clock=clock)
    sampler = StimulusSampler(clock)
    display = SimulatedDisplay(observer, seed, clock, on_question, sampler)
    return Participant(display=display, hand=display, clock=clock, on_session_opened=sampler.on_session_opened)
