"""Conduct one trial of a session, from the wait for the handle to the logged result.

Order: wait until the handle rests at its start position; log the presentation; play the stimulus and ask; log the
answer; release the force; measure the delivered acceleration and log it. A detection trial releases the force before
the question. Each event is on the disk before the next step; only an onset pulse is logged after the reply, so that
writing does not delay the question.
"""

import math
from collections.abc import Callable
from dataclasses import replace

from protocols.definition.apparatus import Plane
from protocols.definition.session_settings import GateSettings
from protocols.trial import Phase, VoidCause
from study.devices.device import Fault, PlaybackResult
from study.session.facts.events import AnswerGiven, OnsetPulsed
from study.session.facts.void_reasons import TOO_LITTLE_MOTION
from study.session.state.due_trial import PresentTrial, has_swapped_labels
from study.session.state.progress import estimate_progress
from study.session.state.state import SessionState, count_repeats_left
from study.session.stimulus.delivered import has_too_little_motion, measure_delivered
from study.session.stimulus.stimulus import PLANE_AXES, compute_direction_vector
from study.session.views.participant_views import HandleView, Question, Task, Unanswered, make_direction_picture
from study.workflows.trial.action_result import ActionResult, find_fault_end_reason, make_early_end_result
from study.workflows.trial.ask_participant import StimulusReply, ask_participant
from study.workflows.trial.judge_trial import get_void_cause, judge_trial
from study.workflows.trial.masking import is_masked
from study.workflows.trial.sitting import Pulse, Sitting, log_and_apply, release_device
from study.workflows.trial.trial_events import (
    TrialOutcome,
    make_answer_health,
    make_presented_event,
    make_void_event,
    record_measured_trial,
)

MASKING_STOPPED = Unanswered("the masking noise stopped during the trial", ends_sitting=False)
"""Reply that replaces an answer that was given without masking noise: the trial is void."""


def make_question(state: SessionState, due_trial: PresentTrial) -> Question:
    """Make the question of a due trial as shown to the participant, without information that could reveal the
    answer."""
    run = state.runs[due_trial.run]
    phase_runs = [
        other_run.index
        for other_run in state.runs
        if (other_run.phase, other_run.practice) == (run.phase, run.practice)
    ]
    return Question(
        phase=run.phase,  # a catch trial looks like one of the test run on the screen
        run_number=1 + phase_runs.index(due_trial.run),
        runs_in_phase=len(phase_runs),
        trial_number=due_trial.trial + 1,
        repeated=due_trial.attempt > 0,
        time_limit_s=state.protocol.trial.time_limit_s,
        picture=make_direction_picture(state.protocol.directions, has_swapped_labels(state.protocol, state.opened)),
        task=Task.INTERVAL if run.phase is Phase.DETECTION else Task.DIRECTION,
        practice=run.practice,
        progress=estimate_progress(state),
        repeats_left=count_repeats_left(state),
    )


def await_handle(state: SessionState, sitting: Sitting) -> Unanswered | None:
    """Wait until the handle has stayed within the gate, `gate.radius_mm` around its start position, for `gate.still_s`.
    Returns None when the trial may start, otherwise why the wait ended early. Does not wait if the gate is off (radius
    0)."""
    gate = state.protocol.gate
    if gate.radius_mm <= 0:
        return None
    read_handle = _make_handle_reader(gate, state.protocol.directions.plane, sitting)
    if gate.still_s <= 0 and read_handle().ready:
        return None
    sitting.supervisor.start_activity("waiting for the handle")
    reply = sitting.display.await_handle(read_handle, sitting.supervisor.keep_alive)
    sitting.supervisor.set_handle_ready(True)
    if reply is None and not read_handle().ready:
        reply = Unanswered("the wait for the handle ended early", ends_sitting=False)
    if reply is None:
        return None
    resolved = sitting.supervisor.resolve(reply)
    return resolved if isinstance(resolved, Unanswered) else None


def _make_handle_reader(gate: GateSettings, plane: Plane, sitting: Sitting) -> Callable[[], HandleView]:
    """Make a function that reads the handle's position and returns whether it has been inside the gate for
    `gate.still_s`, with the instruction for the participant and the offset in the plane from the start position (mm).
    Without a position reading the handle counts as outside, with the offset (0, 0)."""
    inside_since_s: list[float] = []

    def read_handle() -> HandleView:
        offset_m = sitting.supervisor.compute_offset_m(sitting.device.look())
        now_s = sitting.clock.now_s()
        if offset_m is None:
            inside_since_s.clear()
            sitting.supervisor.set_handle_ready(False)
            return HandleView(False, "The device does not say where its handle is.", (0.0, 0.0), gate.radius_mm)
        distance_mm = 1000.0 * math.hypot(*offset_m)
        is_in_gate = distance_mm <= gate.radius_mm
        if not is_in_gate:
            inside_since_s.clear()
        elif not inside_since_s:
            inside_since_s.append(now_s)
        sitting.supervisor.set_handle_ready(is_in_gate)
        is_ready = is_in_gate and now_s - inside_since_s[0] >= gate.still_s
        first_axis, second_axis = PLANE_AXES[plane]
        return HandleView(
            is_ready,
            "Hold it there." if is_in_gate else f"Bring the handle {distance_mm:.0f} mm back to the centre.",
            (1000.0 * offset_m[first_axis], 1000.0 * offset_m[second_axis]),
            gate.radius_mm,
        )

    return read_handle


def present_trial(state: SessionState, due_trial: PresentTrial, sitting: Sitting) -> ActionResult:
    """Run and log one trial: presentation, answer and measurement, or the reason why it is void."""
    early_end = await_handle(state, sitting)
    if early_end is not None:
        return make_early_end_result(state, early_end)
    question = make_question(state, due_trial)
    state = log_and_apply(state, make_presented_event(due_trial, sitting), sitting)
    stimulus_reply = ask_participant(state, due_trial, question, sitting)
    is_masking_intact = is_masked(sitting)
    if stimulus_reply.pulse is not None:
        state = _log_pulse(state, due_trial, stimulus_reply.pulse, sitting)
    if isinstance(stimulus_reply.reply, Unanswered):
        return _log_void_trial(state, due_trial, stimulus_reply, stimulus_reply.reply, sitting)
    if not is_masking_intact:
        return _log_void_trial(state, due_trial, stimulus_reply, MASKING_STOPPED, sitting)
    answer = AnswerGiven(
        utc=sitting.clock.utc(),
        run=due_trial.run,
        trial=due_trial.trial,
        attempt=due_trial.attempt,
        answer=1 if stimulus_reply.reply.answer == 1 else 2,
        response_time_s=max(0.0, stimulus_reply.reply.key_time_s - stimulus_reply.started_s),
        health=make_answer_health(stimulus_reply.health, stimulus_reply.is_complete)
        if stimulus_reply.health is not None
        else None,
    )
    state = log_and_apply(state, answer, sitting)
    play_result = stimulus_reply.play_result if stimulus_reply.play_result is not None else release_device(sitting)
    return _log_answered_trial(state, due_trial, play_result, stimulus_reply, sitting)


def _log_pulse(state: SessionState, due_trial: PresentTrial, pulse: Pulse, sitting: Sitting) -> SessionState:
    """Log the onset pulse, and report to the experimenter if it was lost."""
    pulse_event = OnsetPulsed(
        utc=sitting.clock.utc(),
        run=due_trial.run,
        trial=due_trial.trial,
        attempt=due_trial.attempt,
        line=pulse.line,
        pulsed_s=pulse.at_s,
        trouble=pulse.trouble,
    )
    state = log_and_apply(state, pulse_event, sitting)
    if pulse.trouble:
        sitting.display.trouble(f"The onset pulse of this trial was lost ({pulse.line}: {pulse.trouble}).")
    return state


def _log_answered_trial(
    state: SessionState,
    due_trial: PresentTrial,
    play_result: PlaybackResult,
    stimulus_reply: StimulusReply,
    sitting: Sitting,
) -> ActionResult:
    """Judge an answered trial by the health of device and control loop, and log it as measured (with flags, if any) or
    as void. play_result: recording and health of the stimulus, from its onset to its release."""
    correct = state.answered is not None and state.answered.answer == due_trial.label
    unit_vector = compute_direction_vector(state.protocol.directions, due_trial.direction)
    verdict = judge_trial(
        play_result.health, state.protocol.measurement, stimulus_reply.is_complete, stimulus_reply.health
    )
    recording = play_result.recording if verdict.is_measurable else None
    delivered = measure_delivered(recording, unit_vector, due_trial.frequency_hz) if recording is not None else None
    fault = play_result.health.fault
    end_reason = find_fault_end_reason(fault)
    if verdict.void_reason:
        state = log_and_apply(
            state,
            make_void_event(due_trial, (verdict.void_reason, verdict.cause), play_result.health, sitting),
            sitting,
        )
        return ActionResult(state, end_reason=end_reason, void=verdict.void_reason, fault=fault)
    friction_n = state.protocol.safety.plausibility.friction_n
    measured_recording = recording if delivered is not None else None
    effective_mass_kg = sitting.device.info.effective_mass_kg
    if measured_recording is not None and has_too_little_motion(
        measured_recording, unit_vector, due_trial.frequency_hz, friction_n, effective_mass_kg
    ):
        verdict = replace(verdict, flags=(*verdict.flags, TOO_LITTLE_MOTION))
    outcome = TrialOutcome(play_result, delivered, verdict.flags, unit_vector, verdict.is_measurable)
    state = log_and_apply(state, record_measured_trial(due_trial, outcome, state, sitting), sitting)
    return ActionResult(state, correct, end_reason=end_reason, fault=fault)


def _log_void_trial(
    state: SessionState, due_trial: PresentTrial, stimulus_reply: StimulusReply, reply: Unanswered, sitting: Sitting
) -> ActionResult:
    """Release the force, log a trial without a valid answer as void, and return how the sitting continues."""
    play_result = release_device(sitting) if stimulus_reply.holding else stimulus_reply.play_result
    health = play_result.health if play_result is not None else None
    fault = health.fault if health is not None else Fault.NONE
    # An emergency stop is also a fault, but the reply names who pressed it, which is more informative.
    has_fault = fault is not Fault.NONE and not reply.ends_sitting
    reason = fault.value if has_fault else reply.reason
    cause = get_void_cause(fault) if has_fault else _find_void_cause(reply, sitting)
    state = log_and_apply(state, make_void_event(due_trial, (reason, cause), health, sitting), sitting)
    if reply.ends_sitting:
        return ActionResult(state, end_reason=reply.reason, fault=Fault.NONE if fault is Fault.STOPPED else fault)
    if end_reason := find_fault_end_reason(fault):
        return ActionResult(state, end_reason=end_reason, void=reason, fault=fault)
    if reply.pause:
        return ActionResult(state, pause=reply.reason)
    is_requested = reply.repeat_requested and fault is Fault.NONE
    return ActionResult(state, void="" if is_requested else reason, fault=fault)


def _find_void_cause(reply: Unanswered, sitting: Sitting) -> VoidCause:
    """Find the cause of a void trial in which the device had no fault."""
    requester = sitting.supervisor.stop_requester or sitting.supervisor.pause_requester
    if requester is not None and requester != "participant" and (reply.ends_sitting or reply.pause):
        return VoidCause.EXPERIMENTER
    if reply.ends_sitting:
        return VoidCause.LEFT
    if reply.pause:
        return VoidCause.PAUSED
    return VoidCause.ASKED if reply.repeat_requested else reply.cause
