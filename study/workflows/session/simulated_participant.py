"""A simulated participant for a sitting: an observer model as display and hand, with a clock.

An observer that depends on the delivered acceleration (`DeliveredFeeler`) also gets a sense of touch, which reads the
accelerometer of the device.
"""

from collections.abc import Callable

from study.devices.clock import Clock
from study.participants.delivered_feeler import DeliveredFeeler
from study.participants.observer import Observer
from study.participants.observers import find_observer
from study.session.views.views import Question
from study.workflows.session.conduct_session import Participant
from study.workflows.session.simulated_display import SimulatedDisplay
from study.workflows.session.simulated_touch import SimulatedTouch


def make_simulated_participant(
    name: str, seed: int, clock: Clock, on_question: Callable[[Question], None] | None = None
) -> Participant:
    """The participant with this observer's name, as used on the command line and in the log. Raises StudyError for an
    unknown name."""
    return create_participant(find_observer(name, seed), seed, clock, on_question)


def create_participant(
    observer: Observer, seed: int, clock: Clock, on_question: Callable[[Question], None] | None = None
) -> Participant:
    """The participant with this observer. seed: of the session; on_question: called with each question."""
    if not isinstance(observer, DeliveredFeeler):
        display = SimulatedDisplay(observer, seed, clock, on_question)
        return Participant(display=display, hand=display, clock=clock)
    touch = SimulatedTouch(clock)
    display = SimulatedDisplay(observer, seed, clock, on_question, touch)
    return Participant(display=display, hand=display, clock=clock, on_session_opened=touch.on_session_opened)
