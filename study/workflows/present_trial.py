"""One trial: log, play, ask, log, release, measure, log. Nothing moves before its fact is on the disk."""

import contextlib
from dataclasses import dataclass

from study.devices.device import Fault, Played
from study.session.delivered import delivered
from study.session.due_trial import Present
from study.session.events import AnswerGiven
from study.session.held_stimulus import HeldStimulus
from study.session.state import SessionState
from study.session.stimulus import direction_vector, held_stimulus
from study.session.views import Question, Unanswered
from study.workflows.judge_trial import judge
from study.workflows.sitting import Sitting, record
from study.workflows.trial_facts import Outcome, measured, presented, spoiled


@dataclass(frozen=True, slots=True)
class AfterTrial:
    state: SessionState
    correct: bool | None
    """None for a void trial."""
    leave: str = ""
    """Why the sitting ends here; empty where it goes on."""
    void: str = ""
    """Why the trial is void, where nobody asked for that; empty where it counts."""
    fault: Fault = Fault.NONE


def present_trial(state: SessionState, present: Present, sitting: Sitting) -> AfterTrial:
    question = _question(state, present)
    state = record(state, presented(present, sitting), sitting)
    sitting.device.hold(_stimulus(state, present, sitting))
    sitting.hand.feel(present, state.answers)
    started_s = sitting.clock.now_s()
    reply = sitting.display.ask(question, lambda: _sign_of_life(sitting))
    if isinstance(reply, Unanswered):
        return _void(state, present, reply, sitting)
    answer = AnswerGiven(
        utc=sitting.clock.utc(),
        run=present.run,
        trial=present.trial,
        attempt=present.attempt,
        answer=1 if reply.answer == 1 else 2,
        response_time_s=max(0.0, reply.at_s - started_s),
    )
    # What happens to the stimulus from here on, while a slow disk holds us up, cannot spoil the answer.
    felt_whole = _sign_of_life(sitting)
    state = record(state, answer, sitting)
    return _close(state, present, reply.answer == present.label, felt_whole, sitting)


def _close(state: SessionState, present: Present, correct: bool, felt_whole: bool, sitting: Sitting) -> AfterTrial:
    played = _released(sitting)
    vector = direction_vector(state.protocol.directions, present.direction)
    values = delivered(played.recording, vector, present.frequency_hz) if played.recording else None
    verdict = judge(played.health, values is not None, state.protocol.measurement, felt_whole)
    if verdict.spoiled:
        state = record(state, spoiled(present, verdict.spoiled, played.health, sitting), sitting)
        return _after_void(state, verdict.spoiled, played.health.fault)
    state = record(state, measured(present, Outcome(played, values, verdict.flags, vector), state, sitting), sitting)
    fault = played.health.fault
    return AfterTrial(state, correct, leave=_reason_to_leave(fault), fault=fault)


def _void(state: SessionState, present: Present, reply: Unanswered, sitting: Sitting) -> AfterTrial:
    played = _released(sitting)
    fault = played.health.fault
    reason = fault.value if fault is not Fault.NONE else reply.reason
    state = record(state, spoiled(present, reason, played.health, sitting), sitting)
    if reply.leave:
        return AfterTrial(state, correct=None, leave=reply.reason)
    if reply.asked and fault is Fault.NONE:
        return AfterTrial(state, correct=None)
    return _after_void(state, reason, fault)


def _released(sitting: Sitting) -> Played:
    """Whoever holds the handle hears at once of a force that could not be taken away, before any work on disk."""
    played = sitting.device.release()
    if played.health.fault is Fault.FORCE_LEFT:
        with contextlib.suppress(OSError):
            sitting.display.trouble(played.health.fault.value)
    return played


def _after_void(state: SessionState, reason: str, fault: Fault) -> AfterTrial:
    return AfterTrial(state, correct=None, leave=_reason_to_leave(fault), void=reason, fault=fault)


def _reason_to_leave(fault: Fault) -> str:
    """After these faults a device cannot go on until it is opened again, and somebody must hear of it at once."""
    return fault.value if fault in (Fault.STOPPED, Fault.LOST, Fault.FORCE_LEFT) else ""


def _sign_of_life(sitting: Sitting) -> bool:
    sitting.device.keep_alive()
    return sitting.device.fault() is Fault.NONE


def _stimulus(state: SessionState, present: Present, sitting: Sitting) -> HeldStimulus:
    return held_stimulus(
        state.protocol.stimulus,
        direction_vector(state.protocol.directions, present.direction),
        present.frequency_hz,
        present.polarity * present.level_n,
        sitting.equalizer,
        sitting.device.info.sample_rate_hz,
    )


def _question(state: SessionState, present: Present) -> Question:
    same_phase = [run for run in state.runs if run.phase is present.phase]
    return Question(
        phase=present.phase,
        run_number=1 + [run.index for run in same_phase].index(present.run),
        runs_in_phase=len(same_phase),
        trial_number=present.trial + 1,
        repeated=present.attempt > 0,
        time_limit_s=state.protocol.trial.time_limit_s,
    )
