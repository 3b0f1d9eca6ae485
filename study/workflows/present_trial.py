"""One trial: log, play, ask, log, release, measure, log. Nothing moves before its fact is on the disk."""

from dataclasses import dataclass

from equalizer.signals.recording import Recording
from equalizer.signals.signal import FloatArray
from study.devices.device import Fault, Health, Played
from study.session.delivered import Delivered, delivered
from study.session.events import AnswerGiven, TrialMeasured, TrialPresented, TrialSpoiled
from study.session.held_stimulus import HeldStimulus
from study.session.machine import Present
from study.session.state import SessionState
from study.session.stimulus import direction_vector, held_stimulus
from study.session.views import Answered, Question, Unanswered
from study.store.trial_recordings import SavedRecording, recording_name, save_trial_recording
from study.workflows.judge_trial import judge
from study.workflows.sitting import Sitting, record


@dataclass(frozen=True, slots=True)
class AfterTrial:
    state: SessionState
    leave: str
    """Why the sitting ends here; empty where it goes on."""
    correct: bool | None
    """None for a void trial."""


def present_trial(state: SessionState, present: Present, sitting: Sitting) -> AfterTrial:
    question = _question(state, present)
    state = record(state, _presented(present, sitting), sitting)
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
    state = record(state, answer, sitting)
    return _close(state, present, reply, sitting)


def _close(state: SessionState, present: Present, reply: Answered, sitting: Sitting) -> AfterTrial:
    played = sitting.device.release()
    vector = direction_vector(state.protocol.directions, present.direction)
    values = delivered(played.recording, vector, present.frequency_hz) if played.recording else None
    verdict = judge(played.health, values is not None, state.protocol.measurement)
    if verdict.spoiled:
        state = record(state, _spoiled(present, verdict.spoiled, played.health, sitting), sitting)
        sitting.display.trouble(f"The last trial is void ({verdict.spoiled}); it is drawn again.")
        return AfterTrial(state, leave=_fatal(played.health.fault), correct=None)
    event = _measured(present, played, values, verdict.flags, vector, sitting)
    state = record(state, event, sitting)
    return AfterTrial(state, leave="", correct=reply.answer == present.label)


def _void(state: SessionState, present: Present, reply: Unanswered, sitting: Sitting) -> AfterTrial:
    played = sitting.device.release()
    fault = played.health.fault
    reason = fault.value if fault is not Fault.NONE else reply.reason
    state = record(state, _spoiled(present, reason, played.health, sitting), sitting)
    if fault is not Fault.NONE:
        sitting.display.trouble(f"The trial is void: {reason}. It is drawn again.")
    return AfterTrial(state, leave=reply.reason if reply.leave else _fatal(fault), correct=None)


def _fatal(fault: Fault) -> str:
    """Faults after which this device cannot go on until it is opened again."""
    return fault.value if fault in (Fault.STOPPED, Fault.LOST) else ""


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


def _presented(present: Present, sitting: Sitting) -> TrialPresented:
    return TrialPresented(
        utc=sitting.clock.utc(),
        run=present.run,
        trial=present.trial,
        attempt=present.attempt,
        phase=present.phase,
        frequency_hz=present.frequency_hz,
        level_db=present.level_db,
        level_n=present.level_n,
        direction=1 if present.label == 1 else 2,
        angle_deg=present.angle_deg,
        polarity=1 if present.polarity > 0 else -1,
    )


def _spoiled(present: Present, reason: str, health: Health, sitting: Sitting) -> TrialSpoiled:
    return TrialSpoiled(
        utc=sitting.clock.utc(),
        run=present.run,
        trial=present.trial,
        attempt=present.attempt,
        reason=reason,
        missed_ticks=health.missed_ticks,
    )


def _measured(
    present: Present,
    played: Played,
    values: Delivered | None,
    flags: tuple[str, ...],
    vector: FloatArray,
    sitting: Sitting,
) -> TrialMeasured:
    saved = _save(present, played.recording, played.health, vector, sitting) if played.recording else None
    return TrialMeasured(
        utc=sitting.clock.utc(),
        run=present.run,
        trial=present.trial,
        attempt=present.attempt,
        status="flagged" if flags else "ok",
        flags=flags,
        recording=saved.name if saved else None,
        sha256=saved.sha256 if saved else None,
        delivered_mps2=values.along_mps2 if values else None,
        off_axis_mps2=values.off_axis_mps2 if values else None,
        displacement_mm=values.displacement_mm if values else None,
        missed_ticks=played.health.missed_ticks,
    )


def _save(
    present: Present, recording: Recording, health: Health, vector: FloatArray, sitting: Sitting
) -> SavedRecording:
    """With its conditions inside, so that the file alone tells what was played."""
    conditions = {
        "session": sitting.folder.name,
        "frequency_hz": present.frequency_hz,
        "level_n": present.level_n,
        "unit_vector": [float(v) for v in vector],
        "hand": "held",
        "missed_ticks": health.missed_ticks,
        "equalizer": sitting.equalizer.name,
    }
    name = recording_name(present.run, present.trial, present.attempt)
    return save_trial_recording(sitting.folder, name, recording, conditions)
