"""Result of an action of the session (a trial, a demonstration, a probe, a rest): new state, and how the sitting
continues."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from study.devices.device import Fault
from study.session.state.state import SessionState
from study.session.views.participant_views import Unanswered

if TYPE_CHECKING:
    from study.workflows.trial.sitting import Sitting


@dataclass(frozen=True, slots=True)
class ActionResult:
    """State of the session after an action, and how the sitting continues."""

    state: SessionState
    """State of the session after all events of the action."""
    correct: bool | None = None
    """Whether the answer was right; None for a void trial, and for an action without a question."""
    end_reason: str = ""
    """Why the sitting ends here; empty if it continues."""
    void: str = ""
    """Why the trial is void; empty if it counts, or if its end was requested (a repetition, a pause, a stop)."""
    pause: str = ""
    """Reason for a pause that was requested; empty without a request."""
    fault: Fault = Fault.NONE
    """Fault of the device during the action; NONE also where a requested stop caused it."""


def make_early_end_result(state: SessionState, reply: Unanswered) -> ActionResult:
    """Make the result of a wait or stimulus that ended without an answer: the sitting ends, a pause follows, or the
    trial is void (without a reason if its repetition was requested). reply: why it ended."""
    if reply.ends_sitting:
        return ActionResult(state, end_reason=reply.reason)
    if reply.pause:
        return ActionResult(state, pause=reply.reason)
    return ActionResult(state, void="" if reply.repeat_requested else reply.reason)


def check_end_request(state: SessionState, sitting: Sitting) -> ActionResult | None:
    """Check for requests that arrived while no stimulus was played. Returns the result of a stop or pause; None without
    either."""
    sitting.supervisor.listen()
    reply = sitting.supervisor.resolve(Unanswered("", ends_sitting=False, repeat_requested=True))
    return (
        make_early_end_result(state, reply)
        if isinstance(reply, Unanswered) and (reply.ends_sitting or reply.pause)
        else None
    )


def find_fault_end_reason(fault: Fault) -> str:
    """Find the reason why the sitting ends after this fault: the text of a fault after which the device must be opened
    again; empty for other faults, and without one."""
    return fault.value if fault in (Fault.STOPPED, Fault.LOST, Fault.FORCE_LEFT) else ""
