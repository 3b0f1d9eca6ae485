"""State of a session that an experimenter follows from another terminal.

The state is computed from the log event by event, as in the running session (`study.session.state.fold`); events that
do not affect it (notes, forms, remarks on trials, probes, end of the sitting) are kept in addition.
"""

from dataclasses import dataclass, replace

from protocols.definition.study_protocol import StudyProtocol
from study.session.facts.events import (
    Event,
    ProbeMeasured,
    ProbePlayed,
    SessionInterrupted,
    SessionOpened,
    SessionResumed,
    TrialMeasured,
    TrialPresented,
    TrialSpoiled,
)
from study.session.facts.log_time import seconds_between
from study.session.facts.sitting_events import FormFilled, NoteTaken
from study.session.state.fold import apply
from study.session.state.state import SessionState, begin_session
from study.session.watching.watch_view import FormLine, NoteLine

NO_STEADY_PART = "no steady part to measure, or too little of it"
"""A flag in logs before version 1.1 that is not shown, because nearly every trial has it and it is no fault. Later logs
have the status `unmeasured` instead."""


@dataclass(frozen=True, slots=True)
class PlayedProbe:
    """A probe or reference that was played, and its recording."""

    number: int
    """Number of the probe in the session, from 0."""
    kind: str
    """hand, free or reference, as in `ProbePlayed`."""
    level_n: float
    """Peak of the norm of the force."""
    at_s: float
    """Time since the session was opened."""
    sitting: int
    """Number of the sitting, from 0."""
    recording: str = ""
    """Path of the recording within the session's folder; empty without a recording."""
    trouble: str = ""
    """Why there is no recording, or why it should not be used; empty otherwise."""


@dataclass(frozen=True, slots=True)
class FollowedSession:
    """A followed session: the state computed from its log, and facts that only an observer of the session needs."""

    state: SessionState
    remarks: tuple[str, ...]
    """For each of `state.trials`, its flags or the reason why it is void; empty without a remark."""
    forms: tuple[FormLine, ...]
    notes: tuple[NoteLine, ...]
    """Oldest first."""
    left: str
    """Why the sitting was ended; empty while it has not ended."""
    sitting_utc: str
    """When the present sitting was opened."""
    notes_before: int
    """Number of notes that are older than the present sitting; they come first in `notes`."""
    last_utc: str
    """Time of the last event."""
    sitting: int = 0
    """Number of the present sitting, from 0."""
    playing: PlayedProbe | None = None
    """The probe that is playing, without its measurement; None if there is none."""
    probes: tuple[PlayedProbe, ...] = ()
    """Probes whose measurement is in the log, oldest first."""


def begin_watching(opened: SessionOpened, protocol: StudyProtocol) -> FollowedSession:
    """The followed session after the opening line of its log. Raises LogContradiction where that line and the protocol
    disagree."""
    return FollowedSession(
        state=begin_session(opened, protocol),
        remarks=(),
        forms=(),
        notes=(),
        left="",
        sitting_utc=opened.utc,
        notes_before=0,
        last_utc=opened.utc,
    )


def follow(watched: FollowedSession, event: Event) -> FollowedSession:
    """The followed session after one more event. Raises LogContradiction where the event cannot follow the previous
    ones."""
    after = replace(watched, state=apply(watched.state, event), last_utc=event.utc)
    match event:
        case TrialPresented():
            return replace(after, remarks=(*watched.remarks, ""))
        case TrialMeasured():
            return _set_remark(after, ", ".join(flag for flag in event.flags if flag != NO_STEADY_PART))
        case TrialSpoiled():
            return _set_remark(after, event.reason)
        case ProbePlayed() | ProbeMeasured():
            return _probe(after, event)
        case FormFilled():
            return replace(after, forms=(*watched.forms, FormLine(event.utc, event.form, event.passed)))
        case NoteTaken():
            note = NoteLine(event.utc, event.who, event.text, event.adverse)
            return replace(after, notes=(*watched.notes, note))
        case SessionInterrupted():
            return replace(after, left=event.reason)
        case SessionResumed():
            return replace(
                after, left="", sitting_utc=event.utc, notes_before=len(watched.notes), sitting=watched.sitting + 1
            )
        case _:
            return after


def _probe(watched: FollowedSession, event: ProbePlayed | ProbeMeasured) -> FollowedSession:
    """Note the beginning or the measurement of a probe; a declined reference, which was not played, is left out."""
    if isinstance(event, ProbePlayed):
        at_s = max(0.0, seconds_between(watched.state.opened.utc, event.utc))
        return replace(watched, playing=PlayedProbe(event.number, event.kind, event.level_n, at_s, watched.sitting))
    played = watched.playing
    if played is None or played.number != event.number:
        return watched
    kept = replace(played, recording=event.recording or "", trouble=event.trouble)
    return replace(watched, playing=None, probes=(*watched.probes, kept))


def _set_remark(watched: FollowedSession, remark: str) -> FollowedSession:
    """Set the remark of the latest trial."""
    return replace(watched, remarks=(*watched.remarks[:-1], remark))
