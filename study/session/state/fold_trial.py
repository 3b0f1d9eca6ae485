"""Application of a trial's events (presented, answered, measured or void) to the state of a session.

A trial is open from its presentation until it is measured or void. A measured trial moves the place in the run and,
unless it is a practice or catch trial, the staircase; a void one is due again with the next attempt number. Each adds
its vibration to the dose. An event that does not fit the state raises LogContradictionError.
"""

import math
from dataclasses import replace

from protocols.definition.study_protocol import StudyProtocol
from protocols.procedure.practice import PracticeState, add_answer, is_practice_over
from protocols.procedure.staircase import begin_staircase, is_finished, step
from protocols.trial import Phase, Trial, TrialStatus, VoidCause
from study.session.facts.events import (
    AnswerGiven,
    SessionOpened,
    TrialMeasured,
    TrialPresented,
    TrialSpoiled,
)
from study.session.facts.log_time import compute_wall_clock_s
from study.session.facts.sensor_facts import SensorFacts
from study.session.facts.void_reasons import is_computer_busy
from study.session.state.presentation_check import LogContradictionError, check_presentation, describe_place
from study.session.state.sitting_state import (
    add_exposure,
    estimate_amplitude_mps2,
    start_motion,
)
from study.session.state.state import (
    SessionState,
    count_repeats_left,
    find_due_presentation,
    is_felt_by_person,
    make_current_rule,
)


def present_trial(state: SessionState, event: TrialPresented) -> SessionState:
    """Open this trial. Raises LogContradictionError where another trial is open, no run is left, or the trial differs
    from the presentation that is due."""
    if state.presented is not None:
        raise LogContradictionError(f"{describe_place(event)} presented while another trial is open")
    if state.finished:
        raise LogContradictionError(f"{describe_place(event)} presented after the last run")
    check_presentation(event, find_due_presentation(state))
    repeat_cause = state.trials[-1].void_cause if state.attempt else None
    row = _make_trial_row(state.opened, event, is_felt_by_person(state.opened), repeat_cause)
    return replace(state, presented=event, trials=(*state.trials, row), sitting=start_motion(state.sitting))


def _make_trial_row(
    opening_event: SessionOpened, event: TrialPresented, was_felt: bool | None, repeat_cause: VoidCause | None
) -> Trial:
    """Make the row of `trials.csv` at the presentation; answer and measurement are added later."""
    return Trial(
        subject=opening_event.subject,
        session=opening_event.session,
        run=event.run,
        trial=event.trial,
        attempt=event.attempt,
        phase=event.phase,
        frequency_hz=event.frequency_hz,
        level_n=event.level_n,
        direction_shown=event.direction,
        answer=None,
        correct=None,
        reversal=False,
        response_time_s=None,
        delivered_mps2=None,
        off_axis_mps2=None,
        displacement_mm=None,
        missed_ticks=None,
        felt=was_felt,
        status=TrialStatus.OPEN,
        angle_deg=event.angle_deg,
        wanted_mps2=event.wanted_mps2,
        repeat_cause=repeat_cause,
        onset_s=compute_wall_clock_s(opening_event.utc, event.utc),
        nominal_n=event.nominal_n,
    )


def answer_trial(state: SessionState, event: AnswerGiven) -> SessionState:
    """Set the answer of the open trial; the staircase moves when the trial is measured. Raises LogContradictionError
    where the trial is not open or has an answer."""
    presented = _require_open_trial(state, event)
    if state.answered is not None:
        raise LogContradictionError(f"{describe_place(event)} answered twice")
    row = replace(
        state.trials[-1],
        answer=event.answer,
        correct=event.answer == presented.direction,
        response_time_s=event.response_time_s,
        status=TrialStatus.UNMEASURED,
    )
    return replace(state, answered=event, trials=(*state.trials[:-1], row))


def measure_trial(state: SessionState, event: TrialMeasured) -> SessionState:
    """Close the answered trial: staircase, dose, and the next trial, rest or run. Raises LogContradictionError where
    the trial is not open or has no answer."""
    presented = _require_open_trial(state, event)
    if state.answered is None:
        raise LogContradictionError(f"{describe_place(event)} measured before it was answered")
    stepped_state = _step_staircase(state, presented, correct=state.answered.answer == presented.direction)
    row = replace(
        _set_sensor_facts(state.trials[-1], event.sensor),
        reversal=stepped_state.staircase.reversals > state.staircase.reversals,
        delivered_mps2=event.delivered_mps2,
        off_axis_mps2=event.off_axis_mps2,
        displacement_mm=event.displacement_mm,
        harmonics_mps2=event.harmonics_mps2,
        missed_ticks=event.missed_ticks,
        late_ticks=event.late_ticks,
        latest_s=event.latest_s,
        status=TrialStatus(event.status),
    )
    # Amplitude of the acceleration vector along and across the stimulus.
    amplitude_mps2 = None
    if event.delivered_mps2 is not None:
        amplitude_mps2 = math.hypot(event.delivered_mps2, event.off_axis_mps2 or 0.0)
    updated_state = replace(
        _add_vibration(stepped_state, presented, amplitude_mps2, event.vibrated_s),
        presented=None,
        answered=None,
        trial=state.trial + 1,
        attempt=0,
        trials=(*state.trials[:-1], row),
        rest_due_s=_find_rest_within_run_s(state.protocol, state.trial + 1),
    )
    return _start_next_run(updated_state) if _is_run_over(updated_state) else updated_state


def spoil_trial(state: SessionState, event: TrialSpoiled) -> SessionState:
    """Close the open trial as void, so that it is due again. Raises LogContradictionError where the trial is not open,
    or where the participant asked for a repeat and none is left in this run."""
    presented = _require_open_trial(state, event)
    if event.cause is VoidCause.ASKED and count_repeats_left(state) == 0:
        raise LogContradictionError(
            f"{describe_place(event)} was asked for again, although no repeat of this run remained"
        )
    row = replace(
        _set_sensor_facts(state.trials[-1], event.sensor),
        missed_ticks=event.missed_ticks,
        late_ticks=event.late_ticks,
        latest_s=event.latest_s,
        status=TrialStatus.SPOILED,
        void_cause=event.cause,
    )
    busy_voids = state.sitting.busy_voids + is_computer_busy(event.reason)
    counted_state = replace(state, sitting=replace(state.sitting, busy_voids=busy_voids))
    return replace(
        _add_vibration(counted_state, presented, None, event.vibrated_s),
        presented=None,
        answered=None,
        attempt=state.attempt + 1,
        trials=(*state.trials[:-1], row),
    )


def _set_sensor_facts(row: Trial, sensor: SensorFacts | None) -> Trial:
    """Set the accelerometer's lost packets, garbled bytes and fraction of missing samples; the row is unchanged without
    a sensor."""
    if sensor is None:
        return row
    missing_fraction, garbled_bytes = sensor.missing, sensor.spoiled_bytes
    return replace(row, lost_packets=sensor.lost, garbled_bytes=garbled_bytes, acceleration_missing=missing_fraction)


def _require_open_trial(state: SessionState, event: AnswerGiven | TrialMeasured | TrialSpoiled) -> TrialPresented:
    """Return the presentation to which the event belongs. Raises LogContradictionError where that trial is not open."""
    presented = state.presented
    if presented is None or (presented.run, presented.trial, presented.attempt) != (
        event.run,
        event.trial,
        event.attempt,
    ):
        raise LogContradictionError(f"{event.event} for {describe_place(event)}, which is not open")
    return presented


def _step_staircase(state: SessionState, presented: TrialPresented, correct: bool) -> SessionState:
    """Apply an answer: to the count of a practice run, else to the staircase; no effect in a catch trial."""
    if state.runs[state.run].practice:
        return replace(state, practice=add_answer(state.practice, correct))
    if presented.phase is Phase.CATCH:
        return state
    return replace(state, staircase=step(make_current_rule(state), state.staircase, correct))


def _is_run_over(state: SessionState) -> bool:
    """Whether the current run is finished, by the rule of practice or of the staircase."""
    if state.runs[state.run].practice:
        return is_practice_over(state.protocol.practice, state.practice)
    return is_finished(make_current_rule(state), state.staircase)


def _start_next_run(state: SessionState) -> SessionState:
    """Move the state to the beginning of the next run, with the rest that is due before it; no rest after the last
    run."""
    is_last_run = state.run + 1 == len(state.runs)
    # No enforced rest after a practice run: it is short, and the participant reads its result afterwards.
    rest_s = 0.0 if is_last_run or state.runs[state.run].practice else state.protocol.rests.after_run_s
    updated_state = replace(state, run=state.run + 1, trial=0, attempt=0, practice=PracticeState(), rest_due_s=rest_s)
    return (
        updated_state
        if is_last_run
        else replace(updated_state, staircase=begin_staircase(make_current_rule(updated_state)))
    )


def _find_rest_within_run_s(protocol: StudyProtocol, trial_count: int) -> float:
    """Find the rest (s) that is due after this number of trials of a run; 0 for none."""
    trials_between_rests = protocol.rests.after_trials
    return protocol.rests.within_run_s if trials_between_rests and trial_count % trials_between_rests == 0 else 0.0


def _add_vibration(
    state: SessionState, presented: TrialPresented, amplitude_mps2: float | None, duration_s: float | None
) -> SessionState:
    """Add the vibration of a presentation to the dose, whether or not the trial counts. amplitude_mps2: None where it
    was not measured, and is estimated if possible; duration_s: of the vibration; None where it was not logged."""
    if amplitude_mps2 is None:
        amplitude_mps2 = estimate_amplitude_mps2(state.trials, presented.frequency_hz, presented.level_n)
    sitting = add_exposure(state.sitting, presented.frequency_hz, amplitude_mps2, duration_s)
    return replace(state, sitting=sitting)
