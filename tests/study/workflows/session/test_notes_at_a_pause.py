"""What is typed into a pause is in the log, however the pause ends."""

import pytest

from study.devices.clock import VirtualClock
from study.participants.observer_catalogue import find_observer
from study.session.facts.events import NoteTaken, PauseTaken, SessionInterrupted
from study.session.views.participant_views import AfterPause, Unanswered
from study.session.watching.requests import NoteAsked
from study.store.sessions.event_log import read_log
from study.workflows.session.conduct_session import Participant, conduct_new
from study.workflows.session.simulated_display import SimulatedDisplay
from study.workflows.trial.requests_port import QueuedRequests

PAUSE = Unanswered("asked for a pause", ends_sitting=False, repeat_requested=True, pause=True)


class PausesOnce:
    """A simulated participant who wants a pause at the third question, and notes something in it."""

    def __init__(self, display: SimulatedDisplay, decision: AfterPause, requests: QueuedRequests) -> None:
        self._display, self._decision, self._requests = display, decision, requests
        self._questions = 0

    def ask(self, question, sign_of_life):
        self._questions += 1
        return PAUSE if self._questions == 3 else self._display.ask(question, sign_of_life)

    def pause(self, notice, sign_of_life):
        self._requests.send(NoteAsked("participant", "the phone rang"))
        self._requests.send(NoteAsked("participant", "the thumb is numb", adverse=True))
        return self._decision

    def __getattr__(self, name: str):
        return getattr(self._display, name)


@pytest.mark.parametrize("decision", AfterPause)
def test_notes_and_adverse_events_are_in_the_log_however_the_pause_ends(brief, decision):
    clock, requests = VirtualClock(), QueuedRequests()
    display = SimulatedDisplay(find_observer("scripted", 11), 11, clock)
    participant = Participant(PausesOnce(display, decision, requests), display, clock, requests)
    conducted = conduct_new(brief.plan(), "simulated", participant)
    events = read_log(conducted.folder.log).events
    notes = [(event.text, event.adverse) for event in events if isinstance(event, NoteTaken)]
    assert notes == [("the phone rang", False), ("the thumb is numb", True)]
    kinds = [type(event) for event in events]
    assert kinds.index(NoteTaken) < kinds.index(PauseTaken)
    assert (SessionInterrupted in kinds) is (decision is not AfterPause.CONTINUE_SITTING)
    assert conducted.withdrawn is (decision is AfterPause.WITHDRAW)
