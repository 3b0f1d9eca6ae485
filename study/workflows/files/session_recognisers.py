"""Recognisers of the files of a study (`hapteq validate`): sessions, JSON documents of sessions and studies, locks.

A session folder is checked as a whole: its log is replayed against the rules, the recordings of trials are compared
with the SHA-256 in the log, and the tables with what the log gives. Recordings of probes are not compared.
"""

from dataclasses import MISSING, dataclass, fields
from pathlib import Path

from protocols.document.lock import LOCK_FORMAT, LockError, lock_from_json
from study.errors import StudyError
from study.local_clock import convert_to_machine_zone
from study.session.facts.events import SESSION_FORMAT, TrialMeasured
from study.session.views.local_time import format_time_in_zone
from study.session.watching.live_state import LiveState
from study.store.disk.file_errors import UnusableFileError
from study.store.disk.json_document import read_json
from study.store.disk.provenance import compute_sha256
from study.store.sessions.archive import SessionFolder
from study.store.sessions.event_log import LOG_NAME
from study.store.sessions.live_file import LIVE_FORMAT, LIVE_VERSION
from study.store.sessions.log_seal import SEAL_FORMAT, SEAL_NAME, SEAL_VERSION, read_seal
from study.store.sessions.request_inbox import REQUEST_FORMAT, REQUEST_VERSION
from study.store.sessions.session_summary import SUMMARY_FORMAT, SUMMARY_VERSION
from study.store.sessions.withdrawal_files import (
    TOMBSTONE_FORMAT,
    TOMBSTONE_VERSION,
    WITHDRAWAL_FORMAT,
    WITHDRAWAL_VERSION,
    describe_unfinished_withdrawal,
)
from study.workflows.files.file_content import FileContent
from study.workflows.results.analysis_files import STATISTICS_FORMAT, STATISTICS_VERSION
from study.workflows.results.fold_session import FoldedSession, fold_session
from study.workflows.results.session_results import find_result_problems

SESSION_KIND = "session"
"""Name of a session folder or log in messages."""


@dataclass(frozen=True, slots=True)
class DocumentKind:
    """A kind of JSON document."""

    name: str
    """Of the kind, in words."""
    version: int
    """Of the format, the only one that is accepted."""
    required_keys: tuple[str, ...]


DOCUMENT_KINDS = {
    SUMMARY_FORMAT: DocumentKind(
        "session summary",
        SUMMARY_VERSION,
        ("session", "subject", "protocol", "device", "runs", "answers", "closed"),
    ),
    STATISTICS_FORMAT: DocumentKind(
        "statistics of a study", STATISTICS_VERSION, ("participants", "frequencies_hz", "one_way", "comparisons")
    ),
    SEAL_FORMAT: DocumentKind("seal of a session log", SEAL_VERSION, ("session", "lines", "bytes", "head", "sha256")),
    LIVE_FORMAT: DocumentKind(
        "live state of a session",
        LIVE_VERSION,
        tuple(field.name for field in fields(LiveState) if field.default is MISSING),
    ),
    REQUEST_FORMAT: DocumentKind("request to a running session", REQUEST_VERSION, ("request", "who")),
    WITHDRAWAL_FORMAT: DocumentKind("withdrawal that was begun", WITHDRAWAL_VERSION, ()),
    TOMBSTONE_FORMAT: DocumentKind("tombstone of a withdrawn session", TOMBSTONE_VERSION, ("session", "withdrawn_utc")),
    # Of results: their modules load slowly, or may not be imported here.
    "hapteq-acceptance": DocumentKind("acceptance of a device", 1, ("device", "details", "operator", "accepted_on")),
    "hapteq-contact": DocumentKind("played contact", 1, ("normal", "band_hz", "measured_error", "model_sha256")),
    "hapteq-export": DocumentKind("facts of exported trials", 1, ("versions", "protocol_hash", "seeds")),
    "hapteq-power": DocumentKind("power of a study", 1, ("plan", "judged_hz", "points")),
    "hapteq-bank": DocumentKind("settings of a blind test", 1, ("seed", "brief")),
    "hapteq-proof": DocumentKind("blind test of the diagnosis", 1, ("provenance",)),
}
"""Kinds of JSON documents, by their `format` entry."""


def recognise_session(content: FileContent) -> str | None:
    """Recognise a session folder, or a session log by its name or by the session format in its first 1000 characters
    (the first line of a log states it). A log alone is replayed, without checks of recordings and of tables other than
    the session summary. Returns the session in words; None for other files. Raises UnusableFileError for a damaged
    session, and for a log with another name than `LOG_NAME`: the log of its folder would be replayed in its place."""
    if content.is_folder:
        folder = SessionFolder(content.path.resolve())
        if folder.withdrawn:
            return _describe_withdrawn(folder, content.path)
        return _check_session(folder, content.path) if folder.log.exists() else None
    if content.path.name == LOG_NAME or f'"{SESSION_FORMAT}"' in (content.text or "")[:1000]:
        if content.path.name != LOG_NAME:
            problem = f"a log is only checked under its name {LOG_NAME} in the folder of its session"
            raise UnusableFileError(content.path, "session log", (problem,))
        return _describe_session(_replay_log(SessionFolder(content.path.resolve().parent), content.path))
    return None


def _describe_withdrawn(folder: SessionFolder, path: Path) -> str:
    """Describe a withdrawn session. Raises UnusableFileError where erasing is not finished."""
    if remedy := describe_unfinished_withdrawal(folder):
        raise UnusableFileError(path, "withdrawn session", ("the erasing is not finished", remedy))
    return "withdrawn session; only its tombstone remains"


def recognise_document(content: FileContent) -> str | None:
    """Recognise a JSON document of `DOCUMENT_KINDS`. Returns its kind in words; None for others. Raises
    UnusableFileError where a key is missing, for another version, an invalid seal, and every withdrawal, because a
    finished one leaves no such document."""
    if content.json_format not in DOCUMENT_KINDS:
        return None
    kind = DOCUMENT_KINDS[content.json_format]
    if content.json_format == WITHDRAWAL_FORMAT:
        problem = "the erasing is not finished; `hapteq withdraw` continues it"
        raise UnusableFileError(content.path, kind.name, (problem,))
    if content.json_format == SEAL_FORMAT:
        read_seal(content.path)
    document = read_json(content.path, content.json_format, kind.version)
    missing_keys = [key for key in kind.required_keys if key not in document]
    if missing_keys:
        raise UnusableFileError(content.path, kind.name, (f"it lacks {', '.join(missing_keys)}",))
    return kind.name


def recognise_lock(content: FileContent) -> str | None:
    """Recognise the lock of a protocol. Returns its protocol and time in words; None for others. Raises
    UnusableFileError where it cannot be parsed."""
    if content.json_format != LOCK_FORMAT:
        return None
    try:
        lock = lock_from_json(content.text or "")
    except LockError as error:
        raise UnusableFileError(content.path, "protocol lock", (str(error),)) from error
    return f"lock of protocol '{lock.name}', {format_time_in_zone(lock.locked_utc, convert_to_machine_zone)}"


def _check_session(folder: SessionFolder, path: Path) -> str:
    """Check and describe a session folder whose recordings have the logged SHA-256 and whose tables agree with the log.
    Raises UnusableFileError otherwise."""
    folded_session = _replay_log(folder, path)
    problems = [
        *_find_recording_problems(folder, folded_session),
        *_describe_result_problems(folder, folded_session),
    ]
    if problems:
        raise UnusableFileError(path, SESSION_KIND, tuple(problems))
    return _describe_session(folded_session)


def _replay_log(folder: SessionFolder, path: Path) -> FoldedSession:
    """Replay the session from its log. Raises UnusableFileError for any damage, an incomplete last line included."""
    try:
        folded_session = fold_session(folder)
    except UnusableFileError:
        raise
    except StudyError as error:
        raise UnusableFileError(path, SESSION_KIND, (error.happened.rstrip("."),)) from error
    if folded_session.log_contents.torn_bytes:
        torn_line = f"its last line is torn ({folded_session.log_contents.torn_bytes} bytes); hapteq resume mends it"
        raise UnusableFileError(path, SESSION_KIND, (torn_line,))
    return folded_session


def _find_recording_problems(folder: SessionFolder, folded_session: FoldedSession) -> list[str]:
    """Find recordings of trials that are missing or differ from the SHA-256 in the log."""
    problems = []
    for event in folded_session.log_contents.events:
        if not isinstance(event, TrialMeasured) or event.recording is None:
            continue
        path = folder.path / event.recording
        if not path.is_file():
            problems.append(f"{event.recording} is missing")
        elif compute_sha256(path) != event.sha256:
            problems.append(f"{event.recording} is not the file that was written (its SHA-256 differs from the log)")
    return problems


def _describe_result_problems(folder: SessionFolder, folded_session: FoldedSession) -> list[str]:
    """Describe result files that contradict the log, and a missing seal. A missing table is not an error, because it
    can be written from the log."""
    problem_texts = [f"{SEAL_NAME} is missing; hapteq resume writes it"] if folded_session.seal_due else []
    for result_problem in find_result_problems(folder, folded_session.state):
        if not result_problem.missing:
            problem_texts += [
                f"{result_problem.file} {problem}; the log alone is read" for problem in result_problem.problems
            ]
    return problem_texts


def _describe_session(folded_session: FoldedSession) -> str:
    """Describe a session: participant, protocol, number of answers, end, state of checksums and seal, and steps of the
    clock."""
    state = folded_session.state
    participant = f"simulated participant '{state.opened.observer}'" if state.opened.observer else "a person"
    end_text = state.sitting.ineligibility or ("finished" if state.closed else "not finished")
    clock_step_text = "".join(
        f". Before {format_time_in_zone(step.utc, convert_to_machine_zone)}: {step.sentence}"
        for step in state.sitting.clock_steps
    ).rstrip(".")
    seal_text = f", sealed to line {folded_session.sealed_lines}" if folded_session.sealed_lines else ""
    summary = (
        f"session {state.opened.session} of {participant}, {state.protocol.name}, {state.answers} answers, {end_text}"
    )
    return f"{summary}; log {folded_session.log_contents.chain.describe()}{seal_text}{clock_step_text}"


SESSION_RECOGNISERS = (recognise_session, recognise_document, recognise_lock)
"""Recognisers in the order in which they are tried; the first that returns a kind decides."""
