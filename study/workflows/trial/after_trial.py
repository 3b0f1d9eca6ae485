"""Result of a trial, a demonstration, a probe or a wait for the handle: how the sitting continues. Used by
`present_trial`, `demonstrate`, `play_probe` and the session's loop."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from study.devices.device import Fault
from study.session.state.state import SessionState
from study.session.views.participant_views import Unanswered

if TYPE_CHECKING:
    from study.workflows.trial.sitting import Sitting


@dataclass(frozen=True, slots=True)
class AfterTrial:
    """State of the session after a trial or a wait, and how the sitting continues."""

    state: SessionState
    """State of the session after all events of the trial."""
    correct: bool | None = None
    """Whether the answer was right; None for a void trial, and where there was no question."""
    end_reason: str = ""
    """Why the sitting ends here; empty if it continues."""
    void: str = ""
    """Why the trial is void; empty if it counts, or if the participant asked for its repetition."""
    pause: str = ""
    """Reason for a pause that was asked for; empty without a request."""
    fault: Fault = Fault.NONE
    """Fault of the device during the trial."""


def make_early_end_result(state: SessionState, reply: Unanswered) -> AfterTrial:
    """Make the result of a wait or stimulus that ended without an answer. reply: why it ended (leaving, a pause,
    another reason)."""
    if reply.ends_sitting:
        return AfterTrial(state, end_reason=reply.reason)
    if reply.pause:
        return AfterTrial(state, pause=reply.reason)
    return AfterTrial(state, void="" if reply.repeat_requested else reply.reason)


def check_end_request(state: SessionState, sitting: Sitting) -> AfterTrial | None:
    """Take requests that arrived while no stimulus was played: returns the result of a stop or pause, None without."""
    sitting.supervisor.listen()
    reply = sitting.supervisor.resolve(Unanswered("", ends_sitting=False, repeat_requested=True))
    return (
        make_early_end_result(state, reply)
        if isinstance(reply, Unanswered) and (reply.ends_sitting or reply.pause)
        else None
    )


def find_leaving_reason(fault: Fault) -> str:
    """Find the text of a fault after which the sitting ends, because the device must be opened again; empty for other
    faults."""
    return fault.value if fault in (Fault.STOPPED, Fault.LOST, Fault.FORCE_LEFT) else ""
