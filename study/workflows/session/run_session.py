"""Main loop of a session: ask the state machine for the next action, do it, log it, until nothing is left."""

import contextlib
from dataclasses import dataclass, replace

from protocols.procedure.practice import add_answer, practice_passed, right_of_last
from protocols.trial import Phase
from study.devices.device import Fault
from study.errors import DeviceError, StudyError, UserInterruptError
from study.session.facts.events import RestTaken, SessionClosed, SessionInterrupted
from study.session.facts.void_reasons import busy_sentence, why_too_many
from study.session.state.due_trial import Present, labels_are_swapped
from study.session.state.machine import Action, Demonstrate, FillIn, Finish, Leave, Rest, next_action
from study.session.state.probe_state import Probe, Reference
from study.session.state.progress import progress
from study.session.state.state import SessionState, felt
from study.session.views.archive_views import TURNED_AWAY
from study.session.views.count_text import answers_are
from study.session.views.views import Goodbye, PracticeResult, RestNotice, Welcome, picture_of
from study.store.sessions.log_seal import seal_log
from study.workflows.results.fold_session import fold_session
from study.workflows.session.participant_number import take_place
from study.workflows.session.prepare_sitting import fill_in, prepare_sitting, turn_away
from study.workflows.trial.after_trial import AfterTrial
from study.workflows.trial.demonstrate import demonstrate
from study.workflows.trial.masking import check_masking, start_masking, stop_masking
from study.workflows.trial.play_probe import play_probe, play_reference
from study.workflows.trial.present_trial import present_trial
from study.workflows.trial.sitting import Sitting, notify_experimenter, record, write_notes
from study.workflows.trial.take_pause import take_pause

VOID_TRIALS_IN_A_ROW = 3
"""After this many unrequested void presentations the sitting ends: the participant has left, or the device is
faulty. A stimulus must not play on an unattended handle."""


@dataclass(frozen=True, slots=True)
class SessionEnd:
    """State at the end of a sitting, and why it ended."""

    state: SessionState
    left: str
    """Why the sitting ended before the session was finished; empty if it is finished."""
    fault: Fault = Fault.NONE
    """The device fault, if that was why."""
    why: str = ""
    """The driver's words about it, where there are any."""
    withdrawn: bool = False
    """The participant withdrew consent: the data are to be erased."""


def run_session(state: SessionState, sitting: Sitting) -> SessionEnd:
    """Run until the session is finished or left.

    KeyboardInterrupt (Ctrl-C, a closed terminal) releases the device at once and becomes UserInterruptError. Any
    StudyError is extended by the number of saved answers and how to continue.
    """
    try:
        end = _run_sitting(state, sitting)
    except KeyboardInterrupt as interruption:
        sitting.device.stop()
        return _end_interrupted(sitting, interruption)
    except StudyError as error:
        sitting.device.stop()
        raise _say_how_to_resume(error, sitting) from error
    except BaseException:
        sitting.device.stop()
        raise
    # The session is over: Ctrl-C only ends the goodbye.
    with contextlib.suppress(KeyboardInterrupt):
        outcome = end.state.sitting.turned_away if end.state.closed else ""
        sitting.display.goodbye(Goodbye(not end.left, end.state.answers, end.left, outcome))
    # Notes that were taken while the log was open are written before it is sealed.
    end = replace(end, state=write_notes(end.state, sitting))
    if end.state.closed:
        seal_log(sitting.folder.log)
    return end


def _run_sitting(state: SessionState, sitting: Sitting) -> SessionEnd:
    state, refused = prepare_sitting(state, sitting)
    if state.turned_away_for_good:
        return SessionEnd(turn_away(state, sitting), refused)
    if refused:
        return _end_sitting(AfterTrial(state, leave=refused), sitting)
    state = start_masking(take_place(state, sitting), sitting)
    sitting.supervisor.begin("instructions")
    sitting.display.welcome(_welcome(state, sitting))
    return _run_actions(state, sitting)


def _end_interrupted(sitting: Sitting, interruption: KeyboardInterrupt) -> SessionEnd:
    """End after an interruption. The log decides: a session whose last line was written is finished."""
    state = fold_session(sitting.folder).state
    still_on = sitting.device.fault() is Fault.FORCE_LEFT
    if state.turned_away_for_good:  # nothing was played; its last line may be missing
        state = state if state.closed else turn_away(state, sitting)
        return SessionEnd(state, TURNED_AWAY[state.sitting.turned_away or "refused"])
    if state.closed and not still_on:
        return SessionEnd(state, left="")
    # A full disk must not hide why the sitting ended.
    with contextlib.suppress(StudyError):
        sitting.log.append(
            SessionInterrupted(
                utc=sitting.clock.utc(),
                reason="interrupted: Ctrl-C, or the terminal was closed",
                monotonic_s=sitting.clock.now_s(),
            )
        )
    way_back = f"Continue with: hapteq resume {sitting.folder.path}"
    saved = f"{answers_are(state.answers)} on disk."
    if still_on:
        raise DeviceError("The force may still be on", Fault.FORCE_LEFT.sentence, way_back, saved) from interruption
    raise UserInterruptError("Interrupted", "The force was released.", way_back, saved) from interruption


def _say_how_to_resume(error: StudyError, sitting: Sitting) -> StudyError:
    """The same error with what is saved and how to continue."""
    with contextlib.suppress(StudyError):
        state = fold_session(sitting.folder).state
        if not state.turned_away_for_good:
            error.saved = f"{answers_are(state.answers)} on disk."
            error.do_now = f"{error.do_now} Then continue with: hapteq resume {sitting.folder.path}"
    return error


def _run_actions(state: SessionState, sitting: Sitting) -> SessionEnd:
    voids: tuple[str, ...] = ()
    while True:
        state = write_notes(state, sitting)
        action = next_action(state, sitting.clock.utc(), sitting.clock.now_s())
        if isinstance(action, Finish):
            state = stop_masking(_say_busy(state, sitting), sitting)
            closed = SessionClosed(utc=sitting.clock.utc(), outcome="completed")
            state = record(state, closed, sitting)
            seal_log(sitting.folder.log)
            return SessionEnd(state, left="")
        after = _act(state, action, sitting)
        if not isinstance(action, Probe | Reference):  # these neither void anything nor end a row of void trials
            voids = (*voids, after.void) if after.void else ()
        if len(voids) >= VOID_TRIALS_IN_A_ROW:
            after = replace(after, leave=after.leave or why_too_many(voids))
        pause = _pause_wanted(after, sitting)
        if pause and not after.leave:
            broken = take_pause(stop_masking(after.state, sitting), pause, sitting)
            goes_on = not broken.leave and not sitting.supervisor.stop_asked
            state = start_masking(broken.state, sitting) if goes_on else broken.state
            after = replace(after, state=state, leave=broken.leave)
            if broken.withdrawn:
                return replace(_end_sitting(after, sitting), withdrawn=True)
        if stopped := sitting.supervisor.stop_asked:
            after = replace(after, leave=after.leave or f"the {stopped} stopped the session")
        if after.leave:
            return _end_sitting(after, sitting)
        state = after.state


def _act(state: SessionState, action: Action, sitting: Sitting) -> AfterTrial:
    match action:
        case Leave(reason=reason):
            return AfterTrial(state, leave=reason)
        case Rest(seconds=seconds):
            return AfterTrial(_take_rest(state, seconds, sitting))
        case FillIn(form=form):
            return AfterTrial(fill_in(state, form, sitting))
        case Demonstrate():
            return demonstrate(state, sitting)
        case Present() as present:
            after = present_trial(check_masking(state, sitting), present, sitting)
            if not after.leave:
                _finish_trial(after, present, state, sitting)
            return after
        case Probe():
            after = play_probe(state, action, sitting)
            sitting.clock.sleep(state.protocol.trial.pause_between_s)
            return after
        case Reference():
            return play_reference(state, sitting)
        case Finish():
            return AfterTrial(state)


def _end_sitting(after: AfterTrial, sitting: Sitting) -> SessionEnd:
    state = stop_masking(_say_busy(write_notes(after.state, sitting), sitting), sitting)
    left = SessionInterrupted(utc=sitting.clock.utc(), reason=after.leave)
    why = sitting.device.health().why if after.fault is not Fault.NONE else ""
    return SessionEnd(record(state, left, sitting), after.leave, after.fault, why)


def _say_busy(state: SessionState, sitting: Sitting) -> SessionState:
    """Report void trials of a busy computer at the end of a sitting, on the screen and in the log."""
    if not state.sitting.busy_voids:
        return state
    notify_experimenter(busy_sentence(state.sitting.busy_voids), sitting)
    return write_notes(state, sitting)


def _pause_wanted(after: AfterTrial, sitting: Sitting) -> str:
    sitting.supervisor.listen()
    who = sitting.supervisor.pause_asked
    return after.pause or (f"the {who} asked for a pause" if who else "")


def _finish_trial(after: AfterTrial, present: Present, before: SessionState, sitting: Sitting) -> None:
    if after.void:
        sitting.display.await_return(after.void)
    if after.correct is not None:
        if _feedback_wanted(before, present):
            sitting.display.feedback(after.correct)
        if before.runs[present.run].practice and after.state.run > before.run:
            sitting.display.practice_over(_practice_result(before, after.correct))
    sitting.clock.sleep(before.protocol.trial.pause_between_s)


def _practice_result(before: SessionState, correct: bool) -> PracticeResult:
    settings, done = before.protocol.practice, add_answer(before.practice, correct)
    asked = min(settings.of_last, len(done.correct))
    return PracticeResult(practice_passed(settings, done), right_of_last(settings, done), asked)


def _take_rest(state: SessionState, seconds: float, sitting: Sitting) -> SessionState:
    """A rest cut short by a pause or stop does not count and is due again."""
    sitting.supervisor.begin("rest")
    notice = RestNotice(seconds, len(state.runs) - state.run, progress(state))
    rested_s = max(0.0, sitting.display.rest(notice, sitting.supervisor.glance))
    if rested_s < seconds and (sitting.supervisor.stop_asked or sitting.supervisor.pause_asked):
        return state
    event = RestTaken(utc=sitting.clock.utc(), run=state.run, trial=state.trial, rested_s=rested_s)
    return record(state, event, sitting)


def _feedback_wanted(state: SessionState, present: Present) -> bool:
    protocol, run = state.protocol, state.runs[present.run]
    if run.practice:
        return protocol.practice.feedback == "after_answer"
    settings = protocol.training if run.phase is Phase.TRAINING else protocol.trial
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
