"""Result of a trial, a demonstration or a wait for the handle."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from study.devices.device import Fault
from study.session.state.state import SessionState
from study.session.views.views import Unanswered

if TYPE_CHECKING:
    from study.workflows.trial.sitting import Sitting


@dataclass(frozen=True, slots=True)
class AfterTrial:
    """State after a trial or a wait, and how the sitting goes on."""

    state: SessionState
    correct: bool | None = None
    """None for a void trial, and where nothing was asked."""
    leave: str = ""
    """Why the sitting ends here; empty if it continues."""
    void: str = ""
    """Why the trial is void without having been asked for; empty if it counts."""
    pause: str = ""
    """Who asked for a pause; empty if it was not asked for."""
    fault: Fault = Fault.NONE


def cut_short(state: SessionState, reply: Unanswered) -> AfterTrial:
    """Result if nothing that counts was presented: the participant leaves, wants a pause, or is absent."""
    if reply.leave:
        return AfterTrial(state, leave=reply.reason)
    if reply.pause:
        return AfterTrial(state, pause=reply.reason)
    return AfterTrial(state, void="" if reply.asked else reply.reason)


def check_end_request(state: SessionState, sitting: Sitting) -> AfterTrial | None:
    """A stop or pause requested while nothing was played."""
    sitting.supervisor.listen()
    reply = sitting.supervisor.resolve(Unanswered("", leave=False, asked=True))
    return cut_short(state, reply) if isinstance(reply, Unanswered) and (reply.leave or reply.pause) else None


def reason_to_leave(fault: Fault) -> str:
    """Reason for faults after which the device must be opened again; empty for others."""
    return fault.value if fault in (Fault.STOPPED, Fault.LOST, Fault.FORCE_LEFT) else ""
