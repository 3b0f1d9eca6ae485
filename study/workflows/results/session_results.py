"""Results that are derived from a session's log: seal, tables of trials and thresholds, and summary.

The log is the only source: each result can be computed from it again, and `find_result_problems` compares the files
with what the log gives.
"""

from collections.abc import Callable
from contextlib import suppress
from dataclasses import asdict, dataclass
from functools import partial
from pathlib import Path
from typing import Any

from analysis.psychophysics.detection import compute_detection_thresholds
from analysis.psychophysics.thresholds import Threshold, compute_thresholds
from protocols.trial import Trial
from study.session.state.state import SessionState
from study.store.disk.csv_rows import Row, drop_absent_columns
from study.store.disk.file_errors import CannotReadError, UnusableFileError
from study.store.disk.json_document import write_json
from study.store.disk.provenance import gather_provenance
from study.store.disk.text_file import read_text
from study.store.formats.thresholds_file import DETECTION_NAME, THRESHOLDS_NAME, read_thresholds, write_thresholds
from study.store.formats.trials_file import TRIALS_NAME, read_trials, write_trials
from study.store.sessions.archive import SessionFolder, SessionWithdrawnError
from study.store.sessions.log_seal import SEAL_NAME, find_seals, write_seal
from study.store.sessions.session_lock import hold_session_lock
from study.store.sessions.session_summary import SUMMARY_FORMAT, SUMMARY_NAME, SUMMARY_VERSION, read_summary
from study.workflows.results.analysis_files import ANALYSIS_NAME
from study.workflows.results.fold_session import FoldedSession, fold_session

REPORT_NAME = f"{ANALYSIS_NAME}/report.html"
"""The last file that the analysis of a session writes."""


@dataclass(frozen=True, slots=True)
class ResultProblem:
    """A file of results that is missing, damaged, or does not agree with the log."""

    file: str
    missing: bool
    problems: tuple[str, ...]
    """Clauses without the name of the file and without a full stop."""


def write_tables(folder: SessionFolder) -> SessionState:
    """Write the seal of a closed session if it is due, trials.csv, thresholds.csv, detection.csv (for detection runs)
    and session.json. Returns the state that the log gives. Raises StudyError; SessionWithdrawnError also where the
    participant withdrew while the files were written, which are then removed."""
    folded_session = fold_session(folder)
    state = folded_session.state
    try:
        if folded_session.seal_due:
            write_seal(folder.path, folded_session.log_contents)
        write_trials(folder.path / TRIALS_NAME, state.trials)
        for name, rows in _compute_tables(state).items():
            write_thresholds(folder.path / name, rows)
        _write_summary(folder, state)
    finally:  # also after an error: the withdrawal may have erased a file that was being written or read
        if folder.withdrawn:
            _remove_results(folder)
            raise SessionWithdrawnError(folder)
    return state


def _remove_results(folder: SessionFolder) -> None:
    """Remove the files that `write_tables` writes, as far as possible."""
    names = (TRIALS_NAME, THRESHOLDS_NAME, DETECTION_NAME, SUMMARY_NAME)
    for path in (*find_seals(folder.path).values(), *(folder.path / name for name in names)):
        with suppress(OSError):
            path.unlink()


def list_due_results(folder: SessionFolder, folded_session: FoldedSession) -> tuple[str, ...]:
    """List the names of the results of a closed session that are missing or do not agree with the log, for example
    because the program was killed before it wrote them. Empty for a session that is not closed."""
    if not folded_session.state.closed:
        return ()
    seal_files = (SEAL_NAME,) if folded_session.seal_due else ()
    return (*seal_files, *(problem.file for problem in find_result_problems(folder, folded_session.state)))


def finish_tables(folder: SessionFolder, folded_session: FoldedSession) -> tuple[str, ...]:
    """Write all results under the session's lock if any is due. Returns the names of those due. Raises StudyError."""
    due_files = list_due_results(folder, folded_session)
    if due_files:
        with hold_session_lock(folder.path):
            write_tables(folder)
    return due_files


def find_result_problems(folder: SessionFolder, state: SessionState) -> tuple[ResultProblem, ...]:
    """Find the tables and the summary that are missing, damaged, or differ from the log."""
    problems = [
        _check_file(
            folder, TRIALS_NAME, lambda path: read_trials(path) == _drop_absent_columns(path, state.trials, Trial)
        )
    ]
    for name, rows in _compute_tables(state).items():
        problems.append(_check_file(folder, name, partial(_has_same_thresholds, rows)))
    problems.append(_check_file(folder, SUMMARY_NAME, lambda path: _has_same_summary(folder, state)))
    return tuple(problem for problem in problems if problem is not None)


def _check_file(folder: SessionFolder, name: str, agrees_with_log: Callable[[Path], bool]) -> ResultProblem | None:
    """Check one file. Returns its problem; None where it can be read and `agrees_with_log` is true of its path."""
    path = folder.path / name
    if not path.exists():
        return ResultProblem(name, True, ("is missing",))
    try:
        return None if agrees_with_log(path) else ResultProblem(name, False, ("does not agree with the log",))
    except UnusableFileError as error:
        return ResultProblem(name, False, error.problems)
    except CannotReadError as error:
        return ResultProblem(name, False, (error.happened.rstrip("."),))


def _has_same_thresholds(thresholds: tuple[Threshold, ...], path: Path) -> bool:
    """Whether the file contains these thresholds."""
    return read_thresholds(path) == _drop_absent_columns(path, thresholds, Threshold)


def _drop_absent_columns(path: Path, rows: tuple[Row, ...], row_type: type[Row]) -> tuple[Row, ...]:
    """Set the columns that a file of an older version lacks to their defaults, so that the rows are as the file can
    state them."""
    return drop_absent_columns(read_text(path), rows, row_type)


def _compute_tables(state: SessionState) -> dict[str, tuple[Threshold, ...]]:
    """Compute the tables of thresholds of this session, by file name; that of detection thresholds only if there are
    any."""
    tables = {
        THRESHOLDS_NAME: compute_thresholds(state.trials, state.protocol.staircase, state.protocol.stimulus.rove_db)
    }
    if detection := compute_detection_thresholds(state.trials, state.protocol):
        tables[DETECTION_NAME] = detection
    return tables


def _has_same_summary(folder: SessionFolder, state: SessionState) -> bool:
    """Whether the summary on the disk agrees with the log in all keys that both have; a later version may add keys."""
    stored_summary, expected_summary = read_summary(folder.path), _make_summary(state)
    if stored_summary is None or "session" not in stored_summary:
        return False
    return all(stored_summary[key] == expected_summary[key] for key in stored_summary.keys() & expected_summary.keys())


def _make_summary(state: SessionState) -> dict[str, Any]:
    """Make the content of session.json as JSON values, without format, version and provenance."""
    session_opened = state.opened
    return {
        "session": session_opened.session,
        "subject": session_opened.subject,
        "observer": session_opened.observer,
        "participant_number": session_opened.participant_number if state.has_final_place else None,
        "protocol": {
            "name": state.protocol.name,
            "hash": session_opened.protocol_hash,
            "locked": session_opened.protocol_locked,
        },
        "device": asdict(session_opened.device),
        "equalizer": session_opened.equalizer,
        "begun_utc": session_opened.utc,
        "closed": state.closed,
        "outcome": state.sitting.ineligibility or ("completed" if state.closed else "unfinished"),
        "runs": [
            {"index": run.index, "phase": run.phase.value, "frequency_hz": run.frequency_hz, "practice": run.practice}
            for run in state.runs
        ],
        "answers": state.answers,
        "presentations": len(state.trials),
    }


def _write_summary(folder: SessionFolder, state: SessionState) -> None:
    """Write session.json with its provenance: versions, hash of the protocol, seed, and the log as source."""
    provenance = gather_provenance(
        protocol_hash=state.opened.protocol_hash, seeds={"session": state.opened.seed}, parents=[folder.log]
    )
    write_json(
        folder.path / SUMMARY_NAME, SUMMARY_FORMAT, SUMMARY_VERSION, _make_summary(state), provenance, overwrite=True
    )
