"""Main loop of a session: get the next action from the state machine, perform and log it, until the session is finished
or the sitting ends. A sitting is the time from the start or resumption of a session to its end or interruption.

The state machine is `study.session.state.machine`.
"""

import contextlib
from dataclasses import replace

from protocols.procedure.practice import add_answer, count_right_of_last, is_practice_passed
from protocols.trial import Phase
from study.devices.device import Fault
from study.errors import StudyError
from study.session.facts.events import RestTaken, SessionClosed, SessionInterrupted
from study.session.facts.void_reasons import describe_busy_voids, explain_many_voids
from study.session.state.due_trial import PresentTrial, has_swapped_labels
from study.session.state.machine import Action, Demonstrate, EndSitting, FillIn, Finish, TakeRest, find_next_action
from study.session.state.probe_state import Probe, Reference
from study.session.state.progress import estimate_progress
from study.session.state.state import SessionState, is_felt_by_person
from study.session.views.participant_views import Goodbye, PracticeResult, RestNotice, Welcome, make_direction_picture
from study.store.sessions.log_seal import seal_log
from study.workflows.ignored_interrupts import ignore_interrupts
from study.workflows.results.fold_session import fold_session
from study.workflows.session.participant_number import assign_place
from study.workflows.session.prepare_sitting import close_ineligible_session, prepare_sitting, present_form
from study.workflows.session.session_end import SessionEnd, add_resume_advice, close_interrupted
from study.workflows.trial.action_result import ActionResult
from study.workflows.trial.demonstrate import demonstrate
from study.workflows.trial.masking import check_masking, start_masking, stop_masking
from study.workflows.trial.play_probe import play_probe, play_reference
from study.workflows.trial.present_trial import present_trial
from study.workflows.trial.session_supervisor import SittingStoppedError
from study.workflows.trial.sitting import Sitting, log_and_apply, notify_experimenter, write_notes
from study.workflows.trial.take_pause import take_pause

MAX_VOIDS_IN_A_ROW = 3
"""Number of consecutive void presentations, not requested by the participant, after which the sitting ends: the
participant may have left, and a stimulus must not play on an unattended handle. Chosen."""


def run_session(state: SessionState, sitting: Sitting) -> SessionEnd:
    """Run one sitting: until the session is finished, or the sitting ends early.

    KeyboardInterrupt (Ctrl-C, a closed terminal) stops the device at once and is raised as UserInterruptError, or as
    DeviceError where the force may still be on; a session that is closed in the log, or whose participant is
    ineligible, ends normally instead. A StudyError is extended by the number of saved answers and the resume command,
    and says first where the force may still be on.
    In both cases notes that are not logged yet are logged first, where that is possible.
    """
    try:
        session_end = _run_sitting(state, sitting)
    except KeyboardInterrupt as interruption:
        # A closed terminal interrupts twice: by its signal, and by the end of its input.
        with ignore_interrupts():
            sitting.device.stop()
            return close_interrupted(sitting, interruption)
    except StudyError as error:
        sitting.device.stop()
        raise add_resume_advice(error, sitting) from error
    except BaseException:
        sitting.device.stop()
        raise
    # The sitting is over: Ctrl-C only ends the goodbye, and a stop only takes the force off.
    sitting.display.listen_with(sitting.supervisor.listen)
    with contextlib.suppress(KeyboardInterrupt):
        ineligibility = session_end.state.sitting.ineligibility if session_end.state.closed else ""
        sitting.display.goodbye(
            Goodbye(not session_end.end_reason, session_end.state.answers, session_end.end_reason, ineligibility)
        )
    # Notes that were taken since the log was last written are logged. `_run_actions` has sealed a finished session
    # before the goodbye, so that it is sealed even if the program ends there; later notes get a further seal. A session
    # that was closed without being finished (refusal, exclusion) is sealed here for the first time.
    if not session_end.withdrawn:  # else the log is erased, and a full disk must not hide the withdrawal
        session_end = replace(session_end, state=write_notes(session_end.state, sitting))
    if session_end.state.closed:
        seal_log(sitting.folder.log)
    return session_end


def _run_sitting(state: SessionState, sitting: Sitting) -> SessionEnd:
    """Run the sitting up to its end in the log, also where a stop is requested while a form or a notice is open."""
    sitting.display.listen_with(sitting.supervisor.listen_for_stop)
    try:
        return _prepare_and_run_actions(state, sitting)
    except SittingStoppedError:
        logged_state = fold_session(sitting.folder).state
        return _log_sitting_end(ActionResult(logged_state, end_reason=sitting.supervisor.stop_reason), sitting)


def _prepare_and_run_actions(state: SessionState, sitting: Sitting) -> SessionEnd:
    """Prepare the sitting (forms, device check), assign the participant number, start the masking noise, show the
    instructions where a run is left, and perform the actions."""
    state, end_reason = prepare_sitting(state, sitting)
    if state.is_finally_ineligible:
        return SessionEnd(close_ineligible_session(state, sitting), end_reason)
    if end_reason:
        return _log_sitting_end(ActionResult(state, end_reason=end_reason), sitting)
    state = start_masking(assign_place(state, sitting), sitting)
    if not state.finished:
        sitting.supervisor.start_activity("instructions")
        sitting.display.welcome(_make_welcome(state, sitting))
    return _run_actions(state, sitting)


def _run_actions(state: SessionState, sitting: Sitting) -> SessionEnd:
    """Perform the actions of the state machine, pauses and stop requests until the session is finished or the sitting
    ends."""
    void_reasons: tuple[str, ...] = ()
    while True:
        state = write_notes(state, sitting)
        action = find_next_action(state, sitting.clock.utc(), sitting.clock.now_s())
        if isinstance(action, Finish):
            state = stop_masking(_report_busy_voids(state, sitting), sitting)
            closing_event = SessionClosed(utc=sitting.clock.utc(), outcome="completed")
            state = log_and_apply(state, closing_event, sitting)
            seal_log(sitting.folder.log)
            return SessionEnd(state, end_reason="")
        outcome = _perform_action(state, action, sitting)
        # A probe is never void, and does not interrupt a series of void trials.
        if not isinstance(action, Probe | Reference):
            void_reasons = (*void_reasons, outcome.void) if outcome.void else ()
        if len(void_reasons) >= MAX_VOIDS_IN_A_ROW:
            outcome = replace(outcome, end_reason=outcome.end_reason or explain_many_voids(void_reasons))
        pause_reason = _find_pause_reason(outcome, sitting)
        if pause_reason and not outcome.end_reason:
            pause_outcome = take_pause(stop_masking(outcome.state, sitting), pause_reason, sitting)
            continues = not pause_outcome.end_reason and not sitting.supervisor.stop_requester
            state = start_masking(pause_outcome.state, sitting) if continues else pause_outcome.state
            outcome = replace(outcome, state=state, end_reason=pause_outcome.end_reason)
            if pause_outcome.withdrawn:
                return _end_withdrawn_sitting(outcome, sitting)
        outcome = replace(outcome, end_reason=outcome.end_reason or sitting.supervisor.stop_reason)
        if outcome.end_reason:
            return _log_sitting_end(outcome, sitting)
        state = outcome.state


def _perform_action(state: SessionState, action: Action, sitting: Sitting) -> ActionResult:
    """Perform one action of the state machine; returns the new state and the reasons to pause or end."""
    match action:
        case EndSitting(reason=reason):
            return ActionResult(state, end_reason=reason)
        case TakeRest(seconds=seconds):
            return ActionResult(_conduct_rest(state, seconds, sitting))
        case FillIn(form=form):
            return ActionResult(present_form(state, form, sitting))
        case Demonstrate():
            return demonstrate(state, sitting)
        case PresentTrial() as due_trial:
            outcome = present_trial(check_masking(state, sitting), due_trial, sitting)
            if not outcome.end_reason:
                _finish_trial(outcome, due_trial, state, sitting)
            return outcome
        case Probe():
            outcome = play_probe(state, action, sitting)
            sitting.clock.sleep(state.protocol.trial.pause_between_s)
            return outcome
        case Reference():
            return play_reference(state, sitting)
        case Finish():
            return ActionResult(state)


def _log_sitting_end(outcome: ActionResult, sitting: Sitting) -> SessionEnd:
    """Log why the sitting ended before the session was finished, and return its end. A force that may still be on is
    named also where a stop ended the sitting, whose own fault is not reported."""
    if outcome.fault is Fault.NONE and sitting.device.fault() is Fault.FORCE_LEFT:
        with contextlib.suppress(OSError, KeyboardInterrupt):  # said before any disk access; the sitting ends anyway
            sitting.display.trouble(Fault.FORCE_LEFT.value)
        reason = f"{outcome.end_reason}; {Fault.FORCE_LEFT.value}"
        outcome = replace(outcome, end_reason=reason, fault=Fault.FORCE_LEFT)
    state = stop_masking(_report_busy_voids(write_notes(outcome.state, sitting), sitting), sitting)
    ending_event = SessionInterrupted(utc=sitting.clock.utc(), reason=outcome.end_reason)
    fault_text = sitting.device.health().why if outcome.fault is not Fault.NONE else ""
    return SessionEnd(log_and_apply(state, ending_event, sitting), outcome.end_reason, outcome.fault, fault_text)


def _end_withdrawn_sitting(outcome: ActionResult, sitting: Sitting) -> SessionEnd:
    """Log and return the end of a sitting whose participant withdrew. Returned also where the log cannot be written,
    and after an interruption: the data are erased, and the withdrawal must not be lost."""
    session_end = SessionEnd(outcome.state, outcome.end_reason)
    with contextlib.suppress(StudyError, KeyboardInterrupt):
        session_end = _log_sitting_end(outcome, sitting)
    return replace(session_end, withdrawn=True)


def _report_busy_voids(state: SessionState, sitting: Sitting) -> SessionState:
    """Report the number of trials that were void because the computer was busy, on the screen and in the log."""
    if not state.sitting.busy_voids:
        return state
    notify_experimenter(describe_busy_voids(state.sitting.busy_voids), sitting)
    return write_notes(state, sitting)


def _find_pause_reason(outcome: ActionResult, sitting: Sitting) -> str:
    """Find why the sitting pauses: the reason of the last action, or a request; empty if it does not pause."""
    sitting.supervisor.listen()
    requester = sitting.supervisor.pause_requester
    return outcome.pause or (f"the {requester} asked for a pause" if requester else "")


def _finish_trial(
    outcome: ActionResult, due_trial: PresentTrial, previous_state: SessionState, sitting: Sitting
) -> None:
    """Show feedback, the result of a finished practice, or why the trial was void; then wait until the next trial."""
    if outcome.void:
        sitting.display.await_return(outcome.void)
    if outcome.correct is not None:
        if _is_feedback_due(previous_state, due_trial):
            sitting.display.feedback(outcome.correct)
        if previous_state.runs[due_trial.run].practice and outcome.state.run > previous_state.run:
            sitting.display.practice_over(_make_practice_result(previous_state, outcome.correct))
    sitting.clock.sleep(previous_state.protocol.trial.pause_between_s)


def _make_practice_result(previous_state: SessionState, correct: bool) -> PracticeResult:
    """Make the result of a practice run. correct: whether its last answer was right, which previous_state lacks."""
    settings, practice = previous_state.protocol.practice, add_answer(previous_state.practice, correct)
    question_count = min(settings.of_last, len(practice.correct))
    return PracticeResult(
        is_practice_passed(settings, practice), count_right_of_last(settings, practice), question_count
    )


def _conduct_rest(state: SessionState, duration_s: float, sitting: Sitting) -> SessionState:
    """Conduct a rest of duration_s (s) between trials or runs, and log it. A rest that a pause or stop request
    shortened is not logged, and is due again."""
    sitting.supervisor.start_activity("rest")
    notice = RestNotice(duration_s, len(state.runs) - state.run, estimate_progress(state))
    rested_s = max(0.0, sitting.display.rest(notice, sitting.supervisor.keep_alive))
    if rested_s < duration_s and (sitting.supervisor.stop_requester or sitting.supervisor.pause_requester):
        return state
    event = RestTaken(utc=sitting.clock.utc(), run=state.run, trial=state.trial, rested_s=rested_s)
    return log_and_apply(state, event, sitting)


def _is_feedback_due(state: SessionState, due_trial: PresentTrial) -> bool:
    """Whether the protocol gives feedback after each answer of this trial: by its settings for practice, training or
    test."""
    protocol, run = state.protocol, state.runs[due_trial.run]
    if run.practice:
        return protocol.practice.feedback == "after_answer"
    settings = protocol.training if run.phase is Phase.TRAINING else protocol.trial
    return settings.feedback == "after_answer"


def _make_welcome(state: SessionState, sitting: Sitting) -> Welcome:
    """Make the content of the instructions at the beginning of a sitting."""
    runs_left = state.runs[state.run :]
    training_run_count = sum(run.phase is Phase.TRAINING for run in runs_left)
    return Welcome(
        title=state.protocol.title,
        picture=make_direction_picture(state.protocol.directions, has_swapped_labels(state.protocol, state.opened)),
        runs=len(runs_left) - training_run_count,
        training_runs=training_run_count,
        device=sitting.device.info.name,
        device_moves=is_felt_by_person(state.opened) is not False,
        resumed_after=state.answers,
    )
