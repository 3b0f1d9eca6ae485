"""The reference probes of a session, played without a hand on the handle, as recordings for a diagnosis.

Trials are single frequencies with a hand on the handle, from which no effect can be named. A reference is a multisine
on the free handle, like the recordings of `hapteq record`, and is diagnosed in place of the trials. A remark states
what all probes of the session found changed.
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
    """Recordings of a session's references, to be diagnosed in place of its trials. log: the session's log."""

    log: Path
    paths: tuple[Path, ...]
    remarks: tuple[str, ...]


def find_references(session: Path) -> SessionReferences | None:
    """The references whose recordings are complete and match the log. session: its folder. None where there is none.
    Raises StudyError where the session cannot be read."""
    folder = find_session(str(session), session.absolute().parent)
    folded_session = fold_session(folder)
    if not folded_session.state.protocol.probes.is_enabled:
        return None
    events = folded_session.log_contents.events
    kinds = {event.number: event.kind for event in events if isinstance(event, ProbePlayed)}
    measured = [e for e in events if isinstance(e, ProbeMeasured) and e.recording and not e.trouble]
    paths = tuple(
        folder.path / event.recording
        for event in measured
        if event.recording and kinds[event.number] == "reference" and _is_as_logged(folder, event)
    )
    if not paths:
        return None
    subject, were = ("the reference", "was") if len(paths) == 1 else (f"the {len(paths)} references", "were")
    text = (
        f"Of {folder.name} {subject} without a hand {were} diagnosed, and not its trials, which contain single "
        "frequencies with a hand."
    )
    return SessionReferences(folder.log, paths, (text, *_drifts(folder, folded_session)))


def _is_as_logged(folder: SessionFolder, event: ProbeMeasured) -> bool:
    """Whether the recording exists and has the SHA-256 of the log."""
    path = folder.path / (event.recording or "")
    return path.is_file() and compute_sha256(path) == event.sha256


def _drifts(folder: SessionFolder, folded_session: FoldedSession) -> tuple[str, ...]:
    """A remark on the changes of the device from probe to probe, or that there are none."""
    watched = begin_watching(folded_session.state.opened, folded_session.state.protocol)
    for event in folded_session.log_contents.events[1:]:
        watched = apply_followed_event(watched, event)
    text = "; ".join(drift.sentence for drift in DriftReader(folder).update(watched.probes))
    return (f"In its {len(watched.probes)} probes {f'there changed: {text}' if text else 'no change was detected'}.",)
