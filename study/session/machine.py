"""What to do next in a session. Decides nothing by itself: it reads the state that the events made."""

from dataclasses import dataclass

from study.session.due_trial import Present
from study.session.state import SessionState, due


@dataclass(frozen=True, slots=True)
class Rest:
    seconds: float


@dataclass(frozen=True, slots=True)
class Finish:
    """Nothing is left to do."""


Action = Present | Rest | Finish


def next_action(state: SessionState) -> Action:
    """Raises ValueError while a trial is open: it must be answered, measured or spoiled first."""
    if state.presented is not None:
        raise ValueError("a trial is open; it must be closed before the next action")
    if state.finished:
        return Finish()
    if state.rest_due_s > 0:
        return Rest(seconds=state.rest_due_s)
    return due(state)
