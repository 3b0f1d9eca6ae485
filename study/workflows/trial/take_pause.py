"""A pause: nothing is played until the participant decides how to continue."""

from dataclasses import dataclass

from study.session.facts.events import PauseTaken
from study.session.state.state import SessionState
from study.session.views.views import AfterPause, PauseNotice
from study.workflows.trial.sitting import Sitting, record, write_notes


@dataclass(frozen=True, slots=True)
class PauseOutcome:
    """State after a pause, and whether the sitting goes on."""

    state: SessionState
    leave: str
    """Why the sitting ends here; empty where it goes on."""
    withdrawn: bool


LEAVE = {AfterPause.LEAVE: "the participant left", AfterPause.WITHDRAW: "the participant withdrew"}
"""Why a sitting ends after a pause, by the participant's decision."""


def take_pause(state: SessionState, reason: str, sitting: Sitting) -> PauseOutcome:
    """Show the pause until the participant decides, and log it with its duration. Notes are logged meanwhile. reason:
    shown to the participant."""
    supervisor = sitting.supervisor
    who = supervisor.pause_asked or "participant"
    supervisor.begin("pause")
    started_s = sitting.clock.now_s()

    def glance() -> bool:
        """Notes are written to the disk soon after they were typed, even in a long pause."""
        nonlocal state
        state = write_notes(state, sitting)
        return supervisor.glance()

    decision = sitting.display.pause(PauseNotice(reason, state.answers), glance)
    state = write_notes(state, sitting)
    # A pause that was requested during the pause is over: cleared only after the last check.
    supervisor.pause_asked = None
    paused_s = sitting.clock.now_s() - started_s
    state = record(state, PauseTaken(utc=sitting.clock.utc(), who=who, paused_s=paused_s), sitting)
    if supervisor.stop_asked is not None:
        return PauseOutcome(state, f"the {supervisor.stop_asked} stopped the session", withdrawn=False)
    return PauseOutcome(state, LEAVE.get(decision, ""), withdrawn=decision is AfterPause.WITHDRAW)
