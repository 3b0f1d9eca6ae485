"""Find the reference probes of a session, played without a hand on the handle, as recordings for a diagnosis.

Trials are single frequencies with a hand on the handle. A reference is a multisine on the free handle, like the
recordings of `hapteq record`, and is diagnosed in place of the trials. A remark states which changes of the device the
probes of the session show.
"""

from dataclasses import dataclass
from pathlib import Path

from study.session.facts.events import ProbeMeasured, ProbePlayed
from study.session.watching.followed_session import apply_followed_event, begin_watching
from study.store.disk.provenance import compute_sha256
from study.store.sessions.archive import SessionFolder, find_session
from study.workflows.results.fold_session import FoldedSession, fold_session
from study.workflows.results.session_drift import DriftReader


@dataclass(frozen=True, slots=True)
class SessionReferences:
    """Recordings of a session's references."""

    log: Path
    """Event log of the session."""
    paths: tuple[Path, ...]
    """Recordings, in the order of the log; at least one."""
    remarks: tuple[str, ...]
    """Sentences for the report: which recordings are diagnosed, and the drift of the device over the probes."""


def find_references(session: Path) -> SessionReferences | None:
    """Find the references that were measured without trouble and whose recordings match the log. session: its folder.
    None where there is none, or where the protocol has no probes. Raises StudyError where the session cannot be
    read."""
    folder = find_session(str(session), session.absolute().parent)
    folded_session = fold_session(folder)
    if not folded_session.state.protocol.probes.is_enabled:
        return None
    events = folded_session.log_contents.events
    probe_kinds = {event.number: event.kind for event in events if isinstance(event, ProbePlayed)}
    measured_probes = [
        probe for probe in events if isinstance(probe, ProbeMeasured) and probe.recording and not probe.trouble
    ]
    paths = tuple(
        folder.path / event.recording
        for event in measured_probes
        if event.recording and probe_kinds[event.number] == "reference" and _has_logged_hash(folder, event)
    )
    if not paths:
        return None
    subject, verb = ("the reference", "was") if len(paths) == 1 else (f"the {len(paths)} references", "were")
    remark = (
        f"Of {folder.name} {subject} without a hand {verb} diagnosed, and not its trials, which contain single "
        "frequencies with a hand."
    )
    return SessionReferences(folder.log, paths, (remark, *_describe_drifts(folder, folded_session)))


def _has_logged_hash(folder: SessionFolder, event: ProbeMeasured) -> bool:
    """Whether the recording exists and has the SHA-256 of the log."""
    path = folder.path / (event.recording or "")
    return path.is_file() and compute_sha256(path) == event.sha256


def _describe_drifts(folder: SessionFolder, folded_session: FoldedSession) -> tuple[str, ...]:
    """Describe the changes of the device from probe to probe in one remark, also if none was detected."""
    followed_session = begin_watching(folded_session.state.opened, folded_session.state.protocol)
    for event in folded_session.log_contents.events[1:]:
        followed_session = apply_followed_event(followed_session, event)
    drift_text = "; ".join(drift.sentence for drift in DriftReader(folder).update(followed_session.probes))
    return (
        f"In its {len(followed_session.probes)} probes "
        f"{f'these changes were detected: {drift_text}' if drift_text else 'no change was detected'}.",
    )
