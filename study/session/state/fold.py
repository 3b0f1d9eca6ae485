"""State of a session as the fold of its logged events (event sourcing): state = apply_event(state, event).

`state.begin_session` makes the state from the first event, `apply_event` applies each further one. The state contains
only what follows from the log, so that a session can be resumed after a crash. An event that cannot follow the previous
ones raises LogContradictionError. The events of a trial are applied by `fold_trial`.
"""

import math
from dataclasses import replace

from study.session.facts.events import (
    AnswerGiven,
    DemoFinished,
    DemoPlayed,
    DeviceChecked,
    Event,
    FormFilled,
    NoteTaken,
    PauseTaken,
    PlaceTaken,
    ProbeMeasured,
    ProbePlayed,
    RestTaken,
    SessionClosed,
    SessionInterrupted,
    SessionOpened,
    SessionResumed,
    TrialMeasured,
    TrialPresented,
    TrialSpoiled,
)
from study.session.facts.log_time import Moment
from study.session.state.daily_dose import set_dose_elsewhere
from study.session.state.fold_trial import answer_trial, measure_trial, present_trial, spoil_trial
from study.session.state.presentation_check import LogContradictionError
from study.session.state.probe_state import LARGEST_WEIGHT_HZ, ProbeState, apply_break, begin_probe, end_probe
from study.session.state.rules import is_place_assigned_later
from study.session.state.sitting_state import (
    add_exposure,
    apply_form,
    estimate_amplitude_mps2,
    pass_time,
    resume_sitting,
    start_motion,
)
from study.session.state.state import SessionState, assign_place


def apply_event(state: SessionState, event: Event) -> SessionState:
    """Apply one event; returns the next state. Raises LogContradictionError where the event cannot follow the previous
    ones."""
    if state.closed and not isinstance(event, NoteTaken | SessionInterrupted):
        raise LogContradictionError(f"{event.event} after the session was closed")
    if state.is_finally_ineligible and not isinstance(event, NoteTaken | SessionInterrupted | SessionClosed):
        raise LogContradictionError(f"{event.event} of a person who does not take part")
    moment = Moment(event.utc, event.monotonic_s)
    state = replace(state, sitting=pass_time(state.sitting, moment, resumed=isinstance(event, SessionResumed)))
    match event:
        case TrialPresented():
            return present_trial(state, event)
        case AnswerGiven():
            return answer_trial(state, event)
        case TrialMeasured():
            return measure_trial(state, event)
        case TrialSpoiled():
            return spoil_trial(state, event)
        case _:
            return _apply_between_trials(state, event)


def _apply_between_trials(state: SessionState, event: Event) -> SessionState:
    """Apply an event that is not part of a trial. Raises LogContradictionError for a second opening, and where the
    function for the event raises it."""
    match event:
        case RestTaken():
            return _apply_rest(state, event)
        case PauseTaken():
            return _set_probing(state, apply_break(state.sitting.probing, event, state.protocol.probes))
        case ProbePlayed() | ProbeMeasured():
            return _apply_probe(state, event)
        case FormFilled() | DeviceChecked() | DemoPlayed() | DemoFinished():
            return _apply_preparation(state, event)
        case SessionResumed():
            resumed_sitting = resume_sitting(state.sitting, state.answers)
            return replace(state, sitting=set_dose_elsewhere(resumed_sitting, event.dose_elsewhere))
        case PlaceTaken():
            return _take_place(state, event)
        case SessionClosed():
            return _apply_close(state, event)
        case SessionOpened():
            raise LogContradictionError("a session cannot be opened twice")
        case _:  # at notes, interruptions, onset pulses and masking noise, only time advances
            return state


def _apply_rest(state: SessionState, event: RestTaken) -> SessionState:
    """Apply a rest: no rest is due afterwards. Raises LogContradictionError where none was due."""
    if state.rest_due_s <= 0:
        raise LogContradictionError(f"a rest before trial {event.trial} of run {event.run}, where none was due")
    rested_state = _set_probing(state, apply_break(state.sitting.probing, event, state.protocol.probes))
    return replace(rested_state, rest_due_s=0.0)


def _set_probing(state: SessionState, probing: ProbeState) -> SessionState:
    """Replace the state of the probes."""
    return replace(state, sitting=replace(state.sitting, probing=probing))


def _apply_probe(state: SessionState, event: ProbePlayed | ProbeMeasured) -> SessionState:
    """Apply the beginning or the measurement of a probe; with a hand on the handle, its vibration dose is added. Raises
    LogContradictionError within a trial, in which the hand must feel the trial's stimulus only, and as `begin_probe`
    and `end_probe`."""
    if state.presented is not None:
        raise LogContradictionError(f"{event.event} while a trial is open")
    probing = state.sitting.probing
    if isinstance(event, ProbePlayed):
        moved_sitting = start_motion(state.sitting) if event.kind == "hand" else state.sitting
        return replace(
            state, sitting=replace(moved_sitting, probing=begin_probe(probing, event, state.protocol.probes))
        )
    updated_state = _set_probing(state, end_probe(probing, event))
    if probing.open is None or probing.open.kind != "hand":
        return updated_state
    # The dose is computed from the amplitude of a sine with the measured root mean square.
    amplitude_mps2 = None if event.rms_mps2 is None else math.sqrt(2) * event.rms_mps2
    sitting = add_exposure(updated_state.sitting, LARGEST_WEIGHT_HZ, amplitude_mps2, event.vibrated_s)
    return replace(updated_state, sitting=sitting)


def _take_place(state: SessionState, event: PlaceTaken) -> SessionState:
    """Apply the participant's place in the counterbalanced order. Raises LogContradictionError where none was due."""
    if state.trials or state.sitting.place_assigned or not is_place_assigned_later(state.opened):
        raise LogContradictionError("a place in the order was taken where none was due")
    return assign_place(state, event.participant_number)


def _apply_close(state: SessionState, event: SessionClosed) -> SessionState:
    """Close the session: completed, or because the person does not take part. Raises LogContradictionError where the
    state does not allow this outcome."""
    if event.outcome != "completed":
        if not state.is_finally_ineligible or event.outcome != state.sitting.ineligibility:
            raise LogContradictionError(f"the session was closed as {event.outcome}, which no form says")
        return replace(state, closed=True)
    if not state.finished or state.presented is not None:
        raise LogContradictionError("the session was closed before its last run was finished")
    return replace(state, closed=True)


def _apply_preparation(
    state: SessionState, event: FormFilled | DeviceChecked | DemoPlayed | DemoFinished
) -> SessionState:
    """Apply a form, device check or demonstration. Raises LogContradictionError while a trial is open."""
    if state.presented is not None:
        raise LogContradictionError(f"{event.event} while a trial is open")
    match event:
        case FormFilled():
            return replace(state, sitting=apply_form(state.sitting, event))
        case DeviceChecked():
            return replace(state, sitting=replace(state.sitting, device_checked=event.passed))
        case DemoFinished():
            return replace(state, sitting=replace(state.sitting, demo_done=True))
        case DemoPlayed():
            amplitude_mps2 = estimate_amplitude_mps2(state.trials, event.frequency_hz, event.level_n)
            sitting = add_exposure(start_motion(state.sitting), event.frequency_hz, amplitude_mps2, event.seconds)
            return replace(state, sitting=replace(sitting, demo_count=sitting.demo_count + 1))
