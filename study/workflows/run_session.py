"""The loop of a session: ask the machine what is next, do it, log it, until nothing is left."""

import contextlib
from dataclasses import dataclass

from protocols.trial import Phase
from study.devices.device import Fault
from study.errors import DeviceError, LeftError, StudyError
from study.session.due_trial import Present, labels_are_swapped
from study.session.events import RestTaken, SessionClosed, SessionInterrupted
from study.session.machine import Finish, Rest, next_action
from study.session.state import SessionState, felt
from study.session.views import Goodbye, RestNotice, Welcome, picture_of
from study.workflows.fold_session import fold_session
from study.workflows.present_trial import AfterTrial, present_trial
from study.workflows.sitting import Sitting, record

VOID_TRIALS_IN_A_ROW = 3
"""After so many presentations that nobody asked to repeat were void, the sitting ends: nobody is there, or the device
is not well. A stimulus must not shake an empty chair all night."""


@dataclass(frozen=True, slots=True)
class SessionEnd:
    state: SessionState
    left: str
    """Why the sitting ended before the session was finished; empty where it is finished."""
    fault: Fault = Fault.NONE
    """What was wrong with the device, if that was why."""


def run_session(state: SessionState, sitting: Sitting) -> SessionEnd:
    """Run until the session is finished or somebody leaves.

    KeyboardInterrupt (Ctrl-C, a closed terminal) releases the device at once and leaves as LeftError. Any StudyError
    on the way leaves with the number of answers that are on disk, and how to go on.
    """
    try:
        sitting.display.welcome(_welcome(state, sitting))
        end = _loop(state, sitting)
    except KeyboardInterrupt as interruption:
        sitting.device.stop()
        return _interrupted(sitting, interruption)
    except StudyError as error:
        sitting.device.stop()
        raise _with_the_way_back(error, sitting) from error
    except BaseException:
        sitting.device.stop()
        raise
    sitting.display.goodbye(Goodbye(finished=not end.left, answers=end.state.answers))
    return end


def _interrupted(sitting: Sitting, interruption: KeyboardInterrupt) -> SessionEnd:
    """What is on the disk decides: a session whose last line was written is finished, however it ended."""
    state = fold_session(sitting.folder).state
    still_on = sitting.device.fault() is Fault.FORCE_LEFT
    if state.closed and not still_on:
        return SessionEnd(state, left="")
    # A full disk must not hide why the sitting ended.
    with contextlib.suppress(StudyError):
        sitting.log.append(
            SessionInterrupted(utc=sitting.clock.utc(), reason="interrupted: Ctrl-C, or the terminal was closed")
        )
    way_back = f"Go on with: hapteq resume {sitting.folder.path}"
    saved = f"{state.answers} answers are on disk."
    if still_on:
        raise DeviceError("The force may still be on", Fault.FORCE_LEFT.sentence, way_back, saved) from interruption
    raise LeftError("Interrupted", "The force was released.", way_back, saved) from interruption


def _with_the_way_back(error: StudyError, sitting: Sitting) -> StudyError:
    """The same error; only the session knows how much is safe and how to go on."""
    with contextlib.suppress(StudyError):
        error.saved = f"{fold_session(sitting.folder).state.answers} answers are on disk."
        error.do_now = f"{error.do_now} Then go on with: hapteq resume {sitting.folder.path}"
    return error


def _loop(state: SessionState, sitting: Sitting) -> SessionEnd:
    voids = 0
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
                voids = voids + 1 if after.void else 0
                leave = after.leave or _too_many(voids, after.void)
                if leave:
                    left = SessionInterrupted(utc=sitting.clock.utc(), reason=leave)
                    return SessionEnd(record(state, left, sitting), leave, after.fault)
                _between_trials(after, present, sitting, state)


def _between_trials(after: AfterTrial, present: Present, sitting: Sitting, state: SessionState) -> None:
    if after.void:
        sitting.display.await_return(after.void)
    if after.correct is not None and _feedback_wanted(state, present.phase):
        sitting.display.feedback(after.correct)
    sitting.clock.sleep(state.protocol.trial.pause_between_s)


def _too_many(voids: int, reason: str) -> str:
    return f"{voids} trials in a row were void, the last because {reason}" if voids >= VOID_TRIALS_IN_A_ROW else ""


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
        picture=picture_of(state.protocol.directions, labels_are_swapped(state.protocol, state.opened)),
        runs=len(state.runs) - training,
        training_runs=training,
        device=sitting.device.info.name,
        felt=felt(state.opened) is not False,
        resumed_after=state.answers,
    )
