"""The fold of a trial's events: presented, answered, measured or void; and what they do to staircase, run and dose."""

import math
from dataclasses import replace

from protocols.definition.study_protocol import StudyProtocol
from protocols.procedure.practice import PracticeState, add_answer, practice_over
from protocols.procedure.staircase import begin, is_finished, step
from protocols.trial import Phase, Trial, TrialStatus, VoidCause
from study.session.facts.events import (
    AnswerGiven,
    SessionOpened,
    TrialMeasured,
    TrialPresented,
    TrialSpoiled,
)
from study.session.facts.log_time import seconds_between
from study.session.facts.sensor_facts import SensorFacts
from study.session.facts.void_reasons import computer_too_busy
from study.session.state.draw_check import LogContradiction, check_draw, place_of
from study.session.state.sitting_state import (
    add_exposure,
    likely_amplitude_mps2,
    start_motion,
)
from study.session.state.state import SessionState, current_rule, due, felt, repeats_left


def present_trial(state: SessionState, event: TrialPresented) -> SessionState:
    """The state with this trial open. Raises LogContradiction where it differs from the draw that is due."""
    if state.presented is not None:
        raise LogContradiction(f"{place_of(event)} presented while another trial is open")
    if state.finished:
        raise LogContradiction(f"{place_of(event)} presented after the last run")
    check_draw(event, due(state))
    repeat_cause = state.trials[-1].void_cause if state.attempt else None
    row = _trial_row(state.opened, event, felt(state.opened), repeat_cause)
    return replace(state, presented=event, trials=(*state.trials, row), sitting=start_motion(state.sitting))


def _trial_row(
    opened: SessionOpened, event: TrialPresented, felt: bool | None, repeat_cause: VoidCause | None
) -> Trial:
    """Presentation part of a row of `trials.csv`; answer and measurement follow later."""
    return Trial(
        subject=opened.subject,
        session=opened.session,
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
        felt=felt,
        status=TrialStatus.OPEN,
        angle_deg=event.angle_deg,
        wanted_mps2=event.wanted_mps2,
        repeat_cause=repeat_cause,
        onset_s=seconds_between(opened.utc, event.utc),
        nominal_n=event.nominal_n,
    )


def answer_trial(state: SessionState, event: AnswerGiven) -> SessionState:
    """The open trial with its answer; the staircase follows once it is measured. Raises LogContradiction."""
    presented = _open_trial(state, event)
    if state.answered is not None:
        raise LogContradiction(f"{place_of(event)} answered twice")
    row = replace(
        state.trials[-1],
        answer=event.answer,
        correct=event.answer == presented.direction,
        response_time_s=event.response_time_s,
        status=TrialStatus.UNMEASURED,
    )
    return replace(state, answered=event, trials=(*state.trials[:-1], row))


def measure_trial(state: SessionState, event: TrialMeasured) -> SessionState:
    """The open trial closed: staircase, dose, and the next trial, rest or run. Raises LogContradiction."""
    presented = _open_trial(state, event)
    if state.answered is None:
        raise LogContradiction(f"{place_of(event)} measured before it was answered")
    stepped = _step(state, presented, correct=state.answered.answer == presented.direction)
    row = replace(
        _with_sensor(state.trials[-1], event.sensor),
        reversal=stepped.staircase.reversals > state.staircase.reversals,
        delivered_mps2=event.delivered_mps2,
        off_axis_mps2=event.off_axis_mps2,
        displacement_mm=event.displacement_mm,
        harmonics_mps2=event.harmonics_mps2,
        missed_ticks=event.missed_ticks,
        late_ticks=event.late_ticks,
        latest_s=event.latest_s,
        status=TrialStatus(event.status),
    )
    amplitude_mps2 = None
    if event.delivered_mps2 is not None:
        amplitude_mps2 = math.hypot(event.delivered_mps2, event.off_axis_mps2 or 0.0)
    after = replace(
        _add_vibration(stepped, presented, amplitude_mps2, event.vibrated_s),
        presented=None,
        answered=None,
        trial=state.trial + 1,
        attempt=0,
        trials=(*state.trials[:-1], row),
        rest_due_s=_rest_within_run(state.protocol, state.trial + 1),
    )
    return _next_run(after) if _run_over(after) else after


def spoil_trial(state: SessionState, event: TrialSpoiled) -> SessionState:
    """The open trial void: the same stimulus is due again. Raises LogContradiction."""
    presented = _open_trial(state, event)
    if event.cause is VoidCause.ASKED and repeats_left(state) == 0:
        raise LogContradiction(f"{place_of(event)} was asked for again, where no repeat of this run was left")
    row = replace(
        _with_sensor(state.trials[-1], event.sensor),
        missed_ticks=event.missed_ticks,
        late_ticks=event.late_ticks,
        latest_s=event.latest_s,
        status=TrialStatus.SPOILED,
        void_cause=event.cause,
    )
    busy_voids = state.sitting.busy_voids + computer_too_busy(event.reason)
    counted = replace(state, sitting=replace(state.sitting, busy_voids=busy_voids))
    return replace(
        _add_vibration(counted, presented, None, event.vibrated_s),
        presented=None,
        answered=None,
        attempt=state.attempt + 1,
        trials=(*state.trials[:-1], row),
    )


def _with_sensor(row: Trial, sensor: SensorFacts | None) -> Trial:
    if sensor is None:
        return row
    missing, garbled_bytes = sensor.missing, sensor.spoiled_bytes
    return replace(row, lost_packets=sensor.lost, garbled_bytes=garbled_bytes, acceleration_missing=missing)


def _open_trial(state: SessionState, event: AnswerGiven | TrialMeasured | TrialSpoiled) -> TrialPresented:
    presented = state.presented
    if presented is None or (presented.run, presented.trial, presented.attempt) != (
        event.run,
        event.trial,
        event.attempt,
    ):
        raise LogContradiction(f"{event.event} for {place_of(event)}, which is not open")
    return presented


def _step(state: SessionState, presented: TrialPresented, correct: bool) -> SessionState:
    """Effect of an answer: on the staircase, on a practice run's count, or none in a catch trial."""
    if state.runs[state.run].practice:
        return replace(state, practice=add_answer(state.practice, correct))
    if presented.phase is Phase.CATCH:
        return state
    return replace(state, staircase=step(current_rule(state), state.staircase, correct))


def _run_over(state: SessionState) -> bool:
    if state.runs[state.run].practice:
        return practice_over(state.protocol.practice, state.practice)
    return is_finished(current_rule(state), state.staircase)


def _next_run(state: SessionState) -> SessionState:
    last = state.run + 1 == len(state.runs)
    # Practice runs are short: their rest is the time it takes to read how they went.
    rest_s = 0.0 if last or state.runs[state.run].practice else state.protocol.rests.after_run_s
    after = replace(state, run=state.run + 1, trial=0, attempt=0, practice=PracticeState(), rest_due_s=rest_s)
    return after if last else replace(after, staircase=begin(current_rule(after)))


def _rest_within_run(protocol: StudyProtocol, trials_done: int) -> float:
    every = protocol.rests.after_trials
    return protocol.rests.within_run_s if every and trials_done % every == 0 else 0.0


def _add_vibration(
    state: SessionState, presented: TrialPresented, amplitude_mps2: float | None, seconds: float | None
) -> SessionState:
    """Add the vibration of a presentation to the dose, whether or not the trial counts."""
    if amplitude_mps2 is None:
        amplitude_mps2 = likely_amplitude_mps2(state.trials, presented.frequency_hz, presented.level_n)
    sitting = add_exposure(state.sitting, presented.frequency_hz, amplitude_mps2, seconds)
    return replace(state, sitting=sitting)
