"""State of a session that an experimenter follows from another terminal.

The state is computed from the log event by event, as in the running session (`study.session.state.fold`). What the
state does not keep of them is kept in addition: notes, forms with their times, remarks on trials, recordings of probes,
and why the sitting ended. Begin with `begin_watching` and `apply_followed_event`.
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
from study.session.facts.log_time import compute_wall_clock_s
from study.session.facts.sitting_events import FormFilled, NoteTaken
from study.session.state.fold import apply_event
from study.session.state.state import SessionState, begin_session
from study.session.watching.watch_view import FormRecord, NoteRecord

UNMEASURED_FLAG = "no steady part to measure, or too little of it"
"""Flag of trials in logs before version 1.1. It is not shown, because nearly every trial has it and it is no fault;
later logs have the status `unmeasured` instead."""


@dataclass(frozen=True, slots=True)
class PlayedProbe:
    """A probe or reference that was played, and its recording."""

    number: int
    """Number of the probe in the session, from 0."""
    kind: str
    """hand, free or reference, as in `ProbePlayed`."""
    level_n: float
    """Peak of the norm of the force (N)."""
    started_s: float
    """Time from the opening of the session to the start of the probe (s)."""
    sitting: int
    """Number of the sitting, from 0."""
    recording: str = ""
    """Path of the recording within the session's folder; empty without a recording."""
    trouble: str = ""
    """Reason why there is no recording, or why it should not be used; empty otherwise."""


@dataclass(frozen=True, slots=True)
class FollowedSession:
    """A followed session: the state computed from its log, and what only the experimenter who follows it needs."""

    state: SessionState
    remarks: tuple[str, ...]
    """For each of `state.trials`, its flags or the reason why it is void; empty without a remark."""
    forms: tuple[FormRecord, ...]
    """Forms filled in so far, oldest first."""
    notes: tuple[NoteRecord, ...]
    """Notes of the log, oldest first."""
    end_reason: str
    """Logged reason why the present sitting was interrupted; empty without one."""
    sitting_utc: str
    """Time at which the present sitting was opened (UTC, ISO 8601)."""
    notes_before: int
    """Number of notes that are older than the present sitting; they come first in `notes`."""
    last_utc: str
    """Time of the last event (UTC, ISO 8601)."""
    sitting: int = 0
    """Number of the present sitting, from 0."""
    playing: PlayedProbe | None = None
    """The last probe whose measurement is not in the log yet; None if there is none."""
    probes: tuple[PlayedProbe, ...] = ()
    """Probes that were played and whose measurement is in the log, oldest first."""


def begin_watching(opened: SessionOpened, protocol: StudyProtocol) -> FollowedSession:
    """Make the followed session after the opening event of its log. Raises LogContradictionError where that event and
    the protocol disagree (`begin_session`)."""
    return FollowedSession(
        state=begin_session(opened, protocol),
        remarks=(),
        forms=(),
        notes=(),
        end_reason="",
        sitting_utc=opened.utc,
        notes_before=0,
        last_utc=opened.utc,
    )


def apply_followed_event(followed: FollowedSession, event: Event) -> FollowedSession:
    """Return the followed session after one more event. Raises LogContradictionError where the event cannot follow the
    previous ones."""
    updated_session = replace(followed, state=apply_event(followed.state, event), last_utc=event.utc)
    match event:
        case TrialPresented():
            return replace(updated_session, remarks=(*followed.remarks, ""))
        case TrialMeasured():
            return _set_remark(updated_session, ", ".join(flag for flag in event.flags if flag != UNMEASURED_FLAG))
        case TrialSpoiled():
            return _set_remark(updated_session, event.reason)
        case ProbePlayed() | ProbeMeasured():
            return _record_probe(updated_session, event)
        case FormFilled():
            return replace(updated_session, forms=(*followed.forms, FormRecord(event.utc, event.form, event.passed)))
        case NoteTaken():
            note = NoteRecord(event.utc, event.who, event.text, event.adverse)
            return replace(updated_session, notes=(*followed.notes, note))
        case SessionInterrupted():
            return replace(updated_session, end_reason=event.reason)
        case SessionResumed():
            return replace(
                updated_session,
                end_reason="",
                sitting_utc=event.utc,
                notes_before=len(followed.notes),
                sitting=followed.sitting + 1,
            )
        case _:
            return updated_session


def _record_probe(followed: FollowedSession, event: ProbePlayed | ProbeMeasured) -> FollowedSession:
    """Return the followed session after a probe began or was measured; a declined reference, which was not played, is
    ignored."""
    if isinstance(event, ProbePlayed):
        started_s = max(0.0, compute_wall_clock_s(followed.state.opened.utc, event.utc))
        return replace(
            followed, playing=PlayedProbe(event.number, event.kind, event.level_n, started_s, followed.sitting)
        )
    probe = followed.playing
    if probe is None or probe.number != event.number:
        return followed
    finished_probe = replace(probe, recording=event.recording or "", trouble=event.trouble)
    return replace(followed, playing=None, probes=(*followed.probes, finished_probe))


def _set_remark(followed: FollowedSession, remark: str) -> FollowedSession:
    """Return the followed session with the remark of the latest trial replaced."""
    return replace(followed, remarks=(*followed.remarks[:-1], remark))
