"""Hand-made facts of a session, for folds driven without any device."""

from protocols.document.hashing import hash_protocol
from study.session.facts.events import (
    AnswerGiven,
    DeviceFacts,
    RestTaken,
    SessionOpened,
    TrialMeasured,
    TrialPresented,
)
from study.session.state.fold import apply_event
from study.session.state.machine import PresentTrial, TakeRest, find_next_action

UTC = "2026-01-01T00:00:00.000+00:00"


def opened(protocol, text, **changes):
    facts = {
        "utc": UTC,
        "format": "hapteq-session",
        "version": 1,
        "session": "P01_001",
        "subject": "P01",
        "participant_number": 0,
        "observer": None,
        "protocol_text": text,
        "protocol_hash": hash_protocol(protocol),
        "protocol_locked": False,
        "seed": 7,
        "device": DeviceFacts("a device", simulated=False, sample_rate_hz=1000.0),
        "equalizer": "none",
        "versions": {"hapteq": "0"},
    }
    return SessionOpened(**(facts | changes))


def presented(action: PresentTrial, utc: str = UTC) -> TrialPresented:
    return TrialPresented(
        utc=utc,
        run=action.run,
        trial=action.trial,
        attempt=action.attempt,
        phase=action.phase,
        frequency_hz=action.frequency_hz,
        level_db=action.level_db,
        level_n=action.level_n,
        direction=action.label,
        angle_deg=action.angle_deg,
        polarity=action.polarity,
    )


def answered(action: PresentTrial, correct: bool) -> AnswerGiven:
    answer = action.label if correct else 3 - action.label
    return AnswerGiven(UTC, action.run, action.trial, action.attempt, answer, response_time_s=1.0)


def measured(action: PresentTrial) -> TrialMeasured:
    return TrialMeasured(UTC, action.run, action.trial, action.attempt, "ok", missed_ticks=0)


def one_trial(state, correct: bool):
    """Present, answer, measure; rests on the way."""
    action = find_next_action(state)
    if isinstance(action, TakeRest):
        state = apply_event(state, RestTaken(UTC, state.run, state.trial, rested_s=action.seconds))
        action = find_next_action(state)
    for event in (presented(action), answered(action, correct), measured(action)):
        state = apply_event(state, event)
    return state
