"""A followed session: its state, and the facts that do not affect it (notes, remarks, how it ended)."""

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
"""A flag of logs before version 1.1: on nearly every trial, and no fault. Later logs have the status `unmeasured`."""


@dataclass(frozen=True, slots=True)
class PlayedProbe:
    """A probe and what was kept of it."""

    number: int
    kind: str
    level_n: float
    at_s: float
    """Since the session was opened."""
    sitting: int
    recording: str = ""
    trouble: str = ""


@dataclass(frozen=True, slots=True)
class FollowedSession:
    """A followed session: the state folded from its log, and facts that only a watcher needs."""

    state: SessionState
    remarks: tuple[str, ...]
    """One for each of `state.trials`: its flags, or why it is void."""
    forms: tuple[FormLine, ...]
    notes: tuple[NoteLine, ...]
    """Oldest first."""
    left: str
    """Why the sitting was ended; empty while it was not ended."""
    sitting_utc: str
    """When the present sitting was opened."""
    notes_before: int
    """How many of `notes` are older than the present sitting."""
    last_utc: str
    """Time of the last fact."""
    sitting: int = 0
    playing: PlayedProbe | None = None
    probes: tuple[PlayedProbe, ...] = ()
    """Measured ones."""


def begin_watching(opened: SessionOpened, protocol: StudyProtocol) -> FollowedSession:
    """The followed session after its first line."""
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
    """The followed session after one more event. Raises LogContradiction where it cannot follow."""
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
    if isinstance(event, ProbePlayed):
        at_s = max(0.0, seconds_between(watched.state.opened.utc, event.utc))
        return replace(watched, playing=PlayedProbe(event.number, event.kind, event.level_n, at_s, watched.sitting))
    played = watched.playing
    if played is None or played.number != event.number:
        return watched
    kept = replace(played, recording=event.recording or "", trouble=event.trouble)
    return replace(watched, playing=None, probes=(*watched.probes, kept))


def _set_remark(watched: FollowedSession, remark: str) -> FollowedSession:
    return replace(watched, remarks=(*watched.remarks[:-1], remark))
