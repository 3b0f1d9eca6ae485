"""One trial: wait for the handle, log, play, ask, log, release, measure, log. Nothing moves before its fact is on the
disk."""

from protocols.trial import VoidCause
from study.devices.device import Fault, Played
from study.session.facts.events import AnswerGiven
from study.session.state.due_trial import Present
from study.session.state.state import SessionState
from study.session.stimulus.delivered import delivered
from study.session.stimulus.stimulus import direction_vector
from study.session.views.views import Unanswered
from study.workflows.trial.after_trial import AfterTrial, cut_short, reason_to_leave
from study.workflows.trial.ask_participant import Asked, ask_participant
from study.workflows.trial.await_handle import await_handle
from study.workflows.trial.judge_trial import cause_of, judge
from study.workflows.trial.question import question_of
from study.workflows.trial.release import released
from study.workflows.trial.sitting import Sitting, record
from study.workflows.trial.trial_facts import Outcome, known_then, measured, presented, spoiled


def present_trial(state: SessionState, present: Present, sitting: Sitting) -> AfterTrial:
    hindrance = await_handle(state, sitting)
    if hindrance is not None:
        return cut_short(state, hindrance)
    question = question_of(state, present)
    state = record(state, presented(present, sitting), sitting)
    asked = ask_participant(state, present, question, sitting)
    if isinstance(asked.reply, Unanswered):
        return _void(state, present, asked, asked.reply, sitting)
    answer = AnswerGiven(
        utc=sitting.clock.utc(),
        run=present.run,
        trial=present.trial,
        attempt=present.attempt,
        answer=1 if asked.reply.answer == 1 else 2,
        response_time_s=max(0.0, asked.reply.at_s - asked.started_s),
        health=known_then(asked.health, asked.felt_whole) if asked.health is not None else None,
    )
    state = record(state, answer, sitting)
    played = asked.played if asked.played is not None else released(sitting)
    return _close(state, present, played, asked.felt_whole, sitting)


def _close(state: SessionState, present: Present, played: Played, felt_whole: bool, sitting: Sitting) -> AfterTrial:
    correct = state.answered is not None and state.answered.answer == present.label
    vector = direction_vector(state.protocol.directions, present.direction)
    values = delivered(played.recording, vector, present.frequency_hz) if played.recording else None
    verdict = judge(played.health, state.protocol.measurement, felt_whole)
    fault = played.health.fault
    leave = reason_to_leave(fault)
    if verdict.spoiled:
        state = record(state, spoiled(present, (verdict.spoiled, verdict.cause), played.health, sitting), sitting)
        return AfterTrial(state, leave=leave, void=verdict.spoiled, fault=fault)
    state = record(state, measured(present, Outcome(played, values, verdict.flags, vector), state, sitting), sitting)
    return AfterTrial(state, correct, leave=leave, fault=fault)


def _void(state: SessionState, present: Present, asked: Asked, reply: Unanswered, sitting: Sitting) -> AfterTrial:
    played = released(sitting) if asked.holding else asked.played
    health = played.health if played is not None else None
    fault = health.fault if health is not None else Fault.NONE
    # An emergency stop is a fault too; who pressed it says more.
    faulty = fault is not Fault.NONE and not reply.leave
    reason = fault.value if faulty else reply.reason
    cause = cause_of(fault) if faulty else _cause_of(reply, sitting)
    state = record(state, spoiled(present, (reason, cause), health, sitting), sitting)
    if reply.leave:
        return AfterTrial(state, leave=reply.reason, fault=Fault.NONE if fault is Fault.STOPPED else fault)
    if leave := reason_to_leave(fault):
        return AfterTrial(state, leave=leave, void=reason, fault=fault)
    if reply.pause:
        return AfterTrial(state, pause=reply.reason)
    asked_for = reply.asked and fault is Fault.NONE
    return AfterTrial(state, void="" if asked_for else reason, fault=fault)


def _cause_of(reply: Unanswered, sitting: Sitting) -> VoidCause:
    who = sitting.attendant.stop_asked or sitting.attendant.pause_asked
    if who is not None and who != "participant" and (reply.leave or reply.pause):
        return VoidCause.EXPERIMENTER
    if reply.leave:
        return VoidCause.LEFT
    if reply.pause:
        return VoidCause.PAUSED
    return VoidCause.ASKED if reply.asked else reply.cause
