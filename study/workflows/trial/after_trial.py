"""What a trial, a demonstration or a wait for the handle leaves to its caller."""

from dataclasses import dataclass

from study.devices.device import Fault
from study.session.state.state import SessionState
from study.session.views.views import Unanswered


@dataclass(frozen=True, slots=True)
class AfterTrial:
    state: SessionState
    correct: bool | None = None
    """None for a void trial, and where nothing was asked."""
    leave: str = ""
    """Why the sitting ends here; empty where it goes on."""
    void: str = ""
    """Why the trial is void, where that was not asked for; empty where it counts."""
    pause: str = ""
    """Who asked for a pause; empty where it was not asked for."""
    fault: Fault = Fault.NONE


def cut_short(state: SessionState, reply: Unanswered) -> AfterTrial:
    """Nothing was presented, or nothing that counts: the participant leaves, wants a pause, or is not there."""
    if reply.leave:
        return AfterTrial(state, leave=reply.reason)
    if reply.pause:
        return AfterTrial(state, pause=reply.reason)
    return AfterTrial(state, void="" if reply.asked else reply.reason)


def reason_to_leave(fault: Fault) -> str:
    """After these faults a device cannot go on until it is opened again, and that must be said at once."""
    return fault.value if fault in (Fault.STOPPED, Fault.LOST, Fault.FORCE_LEFT) else ""
