"""Pause a sitting: nothing is played until the participant decides to continue, to leave or to withdraw."""

from dataclasses import dataclass

from study.errors import StudyError
from study.session.facts.events import PauseTaken
from study.session.state.state import SessionState
from study.session.views.participant_views import AfterPause, PauseNotice
from study.workflows.trial.sitting import Sitting, log_and_apply, write_notes


@dataclass(frozen=True, slots=True)
class PauseOutcome:
    """State of the session after a pause, and whether the sitting continues."""

    state: SessionState
    end_reason: str
    """Why the sitting ends here; empty if it continues."""
    withdrawn: bool
    """Whether the participant withdrew, so that the data are to be erased."""


END_REASONS = {AfterPause.END_SITTING: "the participant left", AfterPause.WITHDRAW: "the participant withdrew"}
"""Why a sitting ends after a pause, by the participant's decision; decisions to continue are not listed."""


def take_pause(state: SessionState, reason: str, sitting: Sitting) -> PauseOutcome:
    """Show the pause until the participant decides or a stop is requested, and log it with its duration (s). Notes that
    are taken during the pause are logged at once. reason: shown to the participant. Raises StudyError where the log
    cannot be written, except after a withdrawal."""
    supervisor = sitting.supervisor
    requester = supervisor.pause_requester or "participant"
    supervisor.start_activity("pause")
    started_s = sitting.clock.now_s()

    def sign_of_life() -> bool:
        """Sign of life of the pause, which also writes new notes to the disk: a pause may be long."""
        nonlocal state
        state = write_notes(state, sitting)
        return supervisor.keep_alive()

    decision = sitting.display.pause(PauseNotice(reason, state.answers), sign_of_life)
    is_withdrawal = decision is AfterPause.WITHDRAW
    # Cleared after the pause, so that a request made during the pause does not start another one.
    supervisor.pause_requester = None
    paused_s = sitting.clock.now_s() - started_s
    pause_taken = PauseTaken(utc=sitting.clock.utc(), who=requester, paused_s=paused_s)
    try:
        state = log_and_apply(write_notes(state, sitting), pause_taken, sitting)
    except StudyError:
        # A full disk must not hide a withdrawal, which erases the log.
        if not is_withdrawal:
            raise
    # A stop that is requested at the same time must not hide a withdrawal, which erases the data.
    stop_reason = "" if is_withdrawal else supervisor.stop_reason
    return PauseOutcome(state, stop_reason or END_REASONS.get(decision, ""), is_withdrawal)
