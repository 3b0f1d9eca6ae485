"""The loop of a session: ask the machine what is next, do it, log it, until nothing is left."""

import contextlib
from dataclasses import dataclass

from protocols.trial import Phase
from study.errors import LeftError, StudyError
from study.session.events import RestTaken, SessionClosed, SessionInterrupted
from study.session.machine import Finish, Present, Rest, next_action
from study.session.state import SessionState, felt, labels_are_swapped
from study.session.views import Goodbye, RestNotice, Welcome, picture_of
from study.workflows.fold_session import fold_session
from study.workflows.present_trial import present_trial
from study.workflows.sitting import Sitting, record


@dataclass(frozen=True, slots=True)
class SessionEnd:
    state: SessionState
    left: str
    """Why the sitting ended before the session was finished; empty where it is finished."""


def run_session(state: SessionState, sitting: Sitting) -> SessionEnd:
    """Run until the session is finished or somebody leaves.

    KeyboardInterrupt (Ctrl-C, a closed terminal) releases the device at once and leaves as LeftError.
    """
    try:
        sitting.display.welcome(_welcome(state, sitting))
        end = _loop(state, sitting)
    except KeyboardInterrupt as interruption:
        sitting.device.stop()
        raise _left(sitting) from interruption
    except BaseException:
        sitting.device.stop()
        raise
    notice = Goodbye(finished=not end.left, answers=end.state.answers, folder=sitting.folder.name)
    sitting.display.goodbye(notice)
    return end


def _left(sitting: Sitting) -> LeftError:
    """The device is free already. A full disk must not hide why the sitting ended."""
    with contextlib.suppress(StudyError):
        sitting.log.append(SessionInterrupted(utc=sitting.clock.utc(), reason="interrupted at the keyboard"))
    answers = fold_session(sitting.folder).state.answers
    return LeftError(
        "Interrupted",
        "The force was released.",
        f"Go on with: hapteq resume {sitting.folder.path}",
        saved=f"{answers} answers are on disk.",
    )


def _loop(state: SessionState, sitting: Sitting) -> SessionEnd:
    while True:
        match next_action(state):
            case Finish():
                closed = SessionClosed(utc=sitting.clock.utc(), outcome="completed")
                return SessionEnd(record(state, closed, sitting), left="")
            case Rest(seconds=seconds):
                state = _rest(state, seconds, sitting)
            case Present() as present:
                after = present_trial(state, present, sitting)
                state = after.state
                if after.leave:
                    left = SessionInterrupted(utc=sitting.clock.utc(), reason=after.leave)
                    return SessionEnd(record(state, left, sitting), left=after.leave)
                if after.correct is not None and _feedback_wanted(state, present.phase):
                    sitting.display.feedback(after.correct)
                sitting.clock.sleep(state.protocol.trial.pause_between_s)


def _rest(state: SessionState, seconds: float, sitting: Sitting) -> SessionState:
    notice = RestNotice(seconds=seconds, runs_left=len(state.runs) - state.run)
    rested_s = sitting.display.rest(notice)
    event = RestTaken(utc=sitting.clock.utc(), run=state.run, trial=state.trial, rested_s=rested_s)
    return record(state, event, sitting)


def _feedback_wanted(state: SessionState, phase: Phase) -> bool:
    settings = state.protocol.training if phase is Phase.TRAINING else state.protocol.trial
    return settings.feedback == "after_answer"


def _welcome(state: SessionState, sitting: Sitting) -> Welcome:
    training = sum(run.phase is Phase.TRAINING for run in state.runs)
    return Welcome(
        title=state.protocol.title,
        picture=picture_of(state.protocol.directions, labels_are_swapped(state)),
        runs=len(state.runs) - training,
        training_runs=training,
        device=sitting.device.info.name,
        felt=felt(state.opened) is not False,
        resumed_after=state.answers,
    )
