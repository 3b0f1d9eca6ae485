"""End of a sitting that an interruption or an error ended: what is logged, and what the user is told.

Where the device took no zero force, the user is told that first, also if the log cannot be read or written.
"""

import contextlib
from dataclasses import dataclass

from study.devices.device import Fault
from study.errors import DeviceError, StudyError, UserInterruptError
from study.session.facts.events import SessionInterrupted
from study.session.state.state import SessionState
from study.session.views.archive_views import INELIGIBILITY_REASONS
from study.session.views.count_text import format_answer_count
from study.session.views.resume_command import format_resume_command
from study.store.sessions.log_seal import seal_log
from study.workflows.results.fold_session import fold_session
from study.workflows.session.prepare_sitting import close_ineligible_session, make_ineligible_error
from study.workflows.trial.sitting import Sitting, write_last_notes


@dataclass(frozen=True, slots=True)
class SessionEnd:
    """State of the session at the end of a sitting, and why the sitting ended."""

    state: SessionState
    end_reason: str
    """Why the sitting ended before the session was finished; empty if it is finished."""
    fault: Fault = Fault.NONE
    """Fault of the device that ended the sitting; NONE otherwise."""
    fault_text: str = ""
    """Description of the fault by the driver; empty where it gives none."""
    withdrawn: bool = False
    """Whether the participant withdrew consent, so that the data must be erased."""


def close_interrupted(sitting: Sitting, interruption: KeyboardInterrupt) -> SessionEnd:
    """End a sitting after an interruption. If the participant does not take part, or the session is closed in the log,
    and the force is off, its end is returned. Otherwise UserInterruptError is raised, or StudyError where the log
    cannot be used; where the force may still be on, the error of `put_force_first`."""
    try:
        state = _log_interruption(sitting)
    except StudyError as error:
        raise put_force_first(error, sitting) from interruption
    may_force_remain = sitting.device.fault() is Fault.FORCE_LEFT
    if state.is_finally_ineligible and not may_force_remain:
        return SessionEnd(state, INELIGIBILITY_REASONS[state.sitting.ineligibility or "refused"])
    if state.closed and not may_force_remain:
        return SessionEnd(state, end_reason="")
    if state.is_finally_ineligible:
        raise put_force_first(make_ineligible_error(state), sitting) from interruption
    interrupt_error = UserInterruptError(
        "Interrupted",
        "" if may_force_remain else "The force was released.",
        f"Continue with: {format_resume_command(str(sitting.folder.path), sitting.device_name)}",
        f"{format_answer_count(state.answers)} on disk.",
    )
    raise put_force_first(interrupt_error, sitting) from interruption


def put_force_first(error: StudyError, sitting: Sitting) -> StudyError:
    """Return the error; where the force may still be on, a DeviceError that says this before the error's own text."""
    if sitting.device.fault() is not Fault.FORCE_LEFT:
        return error
    happened = f"{Fault.FORCE_LEFT.sentence} {error.title}. {error.happened}".rstrip()
    return DeviceError("The force may still be on", happened, error.do_now, error.saved)


def add_resume_advice(error: StudyError, sitting: Sitting) -> StudyError:
    """Extend the error, in place, by the number of saved answers and the command that continues the session, not where
    the log cannot be read or the participant does not take part. Returns the error of `put_force_first`."""
    with contextlib.suppress(StudyError):
        state = fold_session(sitting.folder).state
        if not state.is_finally_ineligible:
            error.saved = f"{format_answer_count(state.answers)} on disk."
            resume_command = format_resume_command(str(sitting.folder.path), sitting.device_name)
            error.do_now = f"{error.do_now} Then continue with: {resume_command}"
        write_last_notes(state, sitting)
    return put_force_first(error, sitting)


def _log_interruption(sitting: Sitting) -> SessionState:
    """Log the last notes and, unless the session is closed, its interruption; close the session of a participant who
    does not take part, and seal a closed one. Returns the state after it. Raises StudyError where the log cannot be
    read, or the session not be closed."""
    state = write_last_notes(fold_session(sitting.folder).state, sitting)
    if state.is_finally_ineligible and not state.closed:  # nothing was played; its last line is missing
        state = close_ineligible_session(state, sitting)
    if state.closed:
        seal_log(sitting.folder.log)
        return state
    # A full disk must not hide why the sitting ended.
    with contextlib.suppress(StudyError):
        sitting.log.append(
            SessionInterrupted(
                utc=sitting.clock.utc(),
                reason="interrupted: Ctrl-C, or the terminal was closed",
                monotonic_s=sitting.clock.now_s(),
            )
        )
    return state
