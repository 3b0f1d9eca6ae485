"""One trial of a session, from the wait for the handle to the logged result.

Order: wait until the handle rests at the centre; log the presentation; play the stimulus and ask; log the answer;
release the force; measure the delivered acceleration and log it. A detection trial releases the force before the
question. Each fact is on the disk before the program acts on
it, so that a crash loses no trial and no answer.
"""

import math
from collections.abc import Callable
from dataclasses import replace

from protocols.definition.apparatus import Plane
from protocols.definition.exposure import GateSettings
from protocols.trial import Phase, VoidCause
from study.devices.device import Fault, Played
from study.session.facts.events import AnswerGiven, OnsetPulsed
from study.session.facts.void_reasons import HARDLY_ARRIVED
from study.session.state.due_trial import Present, labels_are_swapped
from study.session.state.progress import progress
from study.session.state.state import SessionState, repeats_left
from study.session.stimulus.delivered import hardly_arrived, measure_delivered
from study.session.stimulus.stimulus import AXES, direction_vector
from study.session.views.views import HandleView, Question, Task, Unanswered, picture_of
from study.workflows.trial.after_trial import AfterTrial, cut_short, reason_to_leave
from study.workflows.trial.ask_participant import StimulusReply, ask_participant
from study.workflows.trial.judge_trial import cause_of, judge
from study.workflows.trial.masking import was_masked
from study.workflows.trial.sitting import Pulse, Sitting, record, release_device
from study.workflows.trial.trial_facts import Outcome, answer_health, trial_measured, trial_presented, trial_spoiled

NOT_MASKED = Unanswered("the masking noise stopped during the trial", leave=False)
"""Replaces an answer that was given without masking noise: the trial is void."""


def question_of(state: SessionState, present: Present) -> Question:
    """A due trial as it is shown to the participant, without anything that could reveal the right answer."""
    run = state.runs[present.run]
    alike = [other.index for other in state.runs if (other.phase, other.practice) == (run.phase, run.practice)]
    return Question(
        phase=run.phase,  # a catch trial looks like one of the test run on the screen
        run_number=1 + alike.index(present.run),
        runs_in_phase=len(alike),
        trial_number=present.trial + 1,
        repeated=present.attempt > 0,
        time_limit_s=state.protocol.trial.time_limit_s,
        picture=picture_of(state.protocol.directions, labels_are_swapped(state.protocol, state.opened)),
        task=Task.INTERVAL if run.phase is Phase.DETECTION else Task.DIRECTION,
        practice=run.practice,
        progress=progress(state),
        repeats_left=repeats_left(state),
    )


def await_handle(state: SessionState, sitting: Sitting) -> Unanswered | None:
    """Wait until the handle has been within the protocol's gate for long enough. None when the trial may start;
    otherwise why the wait ended early. Does not wait where the gate is off (radius 0)."""
    gate = state.protocol.gate
    if gate.radius_mm <= 0:
        return None
    look = _make_look(gate, state.protocol.directions.plane, sitting)
    if gate.still_s <= 0 and look().ready:
        return None
    sitting.supervisor.begin("waiting for the handle")
    reply = sitting.display.await_handle(look, sitting.supervisor.glance)
    sitting.supervisor.handle_is(True)
    if reply is None and not look().ready:
        reply = Unanswered("the wait for the handle ended early", leave=False)
    if reply is None:
        return None
    resolved = sitting.supervisor.resolve(reply)
    return resolved if isinstance(resolved, Unanswered) else None


def _make_look(gate: GateSettings, plane: Plane, sitting: Sitting) -> Callable[[], HandleView]:
    """Function that reads the handle's position and returns whether it has been inside the gate for `gate.still_s`,
    with the instruction for the participant and the offset in the plane (mm)."""
    inside_since_s: list[float] = []

    def look() -> HandleView:
        offset = sitting.supervisor.offset_m(sitting.device.look())
        now_s = sitting.clock.now_s()
        if offset is None:
            inside_since_s.clear()
            sitting.supervisor.handle_is(False)
            return HandleView(False, "The device does not say where its handle is.", (0.0, 0.0), gate.radius_mm)
        distance_mm = 1000.0 * math.hypot(*offset)
        inside = distance_mm <= gate.radius_mm
        if not inside:
            inside_since_s.clear()
        elif not inside_since_s:
            inside_since_s.append(now_s)
        sitting.supervisor.handle_is(inside)
        ready = inside and now_s - inside_since_s[0] >= gate.still_s
        first, second = AXES[plane]
        return HandleView(
            ready,
            "Hold it there." if inside else f"Bring the handle {distance_mm:.0f} mm back to the centre.",
            (1000.0 * offset[first], 1000.0 * offset[second]),
            gate.radius_mm,
        )

    return look


def present_trial(state: SessionState, present: Present, sitting: Sitting) -> AfterTrial:
    """Run one trial: presentation, answer and measurement, or the reason why it is void. Everything is logged."""
    hindrance = await_handle(state, sitting)
    if hindrance is not None:
        return cut_short(state, hindrance)
    question = question_of(state, present)
    state = record(state, trial_presented(present, sitting), sitting)
    asked = ask_participant(state, present, question, sitting)
    masked = was_masked(sitting)
    if asked.pulse is not None:
        state = _log_pulse(state, present, asked.pulse, sitting)
    if isinstance(asked.reply, Unanswered):
        return _void(state, present, asked, asked.reply, sitting)
    if not masked:
        return _void(state, present, asked, NOT_MASKED, sitting)
    answer = AnswerGiven(
        utc=sitting.clock.utc(),
        run=present.run,
        trial=present.trial,
        attempt=present.attempt,
        answer=1 if asked.reply.answer == 1 else 2,
        response_time_s=max(0.0, asked.reply.at_s - asked.started_s),
        health=answer_health(asked.health, asked.felt_whole) if asked.health is not None else None,
    )
    state = record(state, answer, sitting)
    played = asked.played if asked.played is not None else release_device(sitting)
    return _close(state, present, played, asked, sitting)


def _log_pulse(state: SessionState, present: Present, pulse: Pulse, sitting: Sitting) -> SessionState:
    """Log the onset pulse, after the answer: no write to the disk may delay the question after the onset."""
    fact = OnsetPulsed(
        utc=sitting.clock.utc(),
        run=present.run,
        trial=present.trial,
        attempt=present.attempt,
        line=pulse.line,
        pulsed_s=pulse.at_s,
        trouble=pulse.trouble,
    )
    state = record(state, fact, sitting)
    if pulse.trouble:
        sitting.display.trouble(f"The onset pulse of this trial was lost ({pulse.line}: {pulse.trouble}).")
    return state


def _close(state: SessionState, present: Present, played: Played, asked: StimulusReply, sitting: Sitting) -> AfterTrial:
    """Judge an answered trial by the health of device and loop, and log it as measured, flagged or spoiled. played: the
    stimulus until its release."""
    correct = state.answered is not None and state.answered.answer == present.label
    vector = direction_vector(state.protocol.directions, present.direction)
    verdict = judge(played.health, state.protocol.measurement, asked.felt_whole, asked.health)
    recording = played.recording if verdict.measured else None
    values = measure_delivered(recording, vector, present.frequency_hz) if recording is not None else None
    fault = played.health.fault
    leave = reason_to_leave(fault)
    if verdict.spoiled:
        state = record(state, trial_spoiled(present, (verdict.spoiled, verdict.cause), played.health, sitting), sitting)
        return AfterTrial(state, leave=leave, void=verdict.spoiled, fault=fault)
    friction_n = state.protocol.safety.plausibility.friction_n
    measured = recording if values is not None else None
    device_kg = sitting.device.info.effective_mass_kg
    if measured is not None and hardly_arrived(measured, vector, present.frequency_hz, friction_n, device_kg):
        verdict = replace(verdict, flags=(*verdict.flags, HARDLY_ARRIVED))
    outcome = Outcome(played, values, verdict.flags, vector, verdict.measured)
    state = record(state, trial_measured(present, outcome, state, sitting), sitting)
    return AfterTrial(state, correct, leave=leave, fault=fault)


def _void(
    state: SessionState, present: Present, asked: StimulusReply, reply: Unanswered, sitting: Sitting
) -> AfterTrial:
    """Release the force, log a trial without a valid answer as spoiled, and return how the sitting continues."""
    played = release_device(sitting) if asked.holding else asked.played
    health = played.health if played is not None else None
    fault = health.fault if health is not None else Fault.NONE
    # An emergency stop is also a fault, but the reply names who pressed it, which is more informative.
    faulty = fault is not Fault.NONE and not reply.leave
    reason = fault.value if faulty else reply.reason
    cause = cause_of(fault) if faulty else _cause_of(reply, sitting)
    state = record(state, trial_spoiled(present, (reason, cause), health, sitting), sitting)
    if reply.leave:
        return AfterTrial(state, leave=reply.reason, fault=Fault.NONE if fault is Fault.STOPPED else fault)
    if leave := reason_to_leave(fault):
        return AfterTrial(state, leave=leave, void=reason, fault=fault)
    if reply.pause:
        return AfterTrial(state, pause=reply.reason)
    asked_for = reply.asked and fault is Fault.NONE
    return AfterTrial(state, void="" if asked_for else reason, fault=fault)


def _cause_of(reply: Unanswered, sitting: Sitting) -> VoidCause:
    """Why a trial without a fault of the device is void."""
    who = sitting.supervisor.stop_asked or sitting.supervisor.pause_asked
    if who is not None and who != "participant" and (reply.leave or reply.pause):
        return VoidCause.EXPERIMENTER
    if reply.leave:
        return VoidCause.LEFT
    if reply.pause:
        return VoidCause.PAUSED
    return VoidCause.ASKED if reply.asked else reply.cause
