"""What is written from a session's log, at will: its tables, and its own small report."""

from dataclasses import asdict

from analysis.detection import detection_thresholds
from analysis.thresholds import thresholds
from study.session.state import SessionState
from study.store.archive import SessionFolder
from study.store.json_document import write_json
from study.store.provenance import gather_provenance
from study.store.thresholds_file import DETECTION_NAME, THRESHOLDS_NAME, write_thresholds
from study.store.trials_file import TRIALS_NAME, write_trials
from study.workflows.analysis_files import ANALYSIS_NAME
from study.workflows.fold_session import fold_session
from study.workflows.written_analysis import WrittenAnalysis

SUMMARY_NAME = "session.json"
SUMMARY_FORMAT = "hapteq-session-summary"
SUMMARY_VERSION = 1


def write_tables(folder: SessionFolder) -> SessionState:
    """trials.csv, thresholds.csv, detection.csv (where there are such runs) and session.json, from the log alone."""
    state = fold_session(folder).state
    write_trials(folder.path / TRIALS_NAME, state.trials)
    rows = thresholds(state.trials, state.protocol.staircase)
    write_thresholds(folder.path / THRESHOLDS_NAME, rows)
    if detection := detection_thresholds(state.trials, state.protocol):
        write_thresholds(folder.path / DETECTION_NAME, detection)
    _write_summary(folder, state)
    return state


def write_results(folder: SessionFolder) -> WrittenAnalysis:
    """The tables, and the analysis of this session alone beside them."""
    # Statistics and plots take longer to load than all else; nobody who begins or checks a session waits for them.
    from study.workflows.analyze_data import analyze_data

    write_tables(folder)
    return analyze_data(folder.path, folder.path / ANALYSIS_NAME)


def _write_summary(folder: SessionFolder, state: SessionState) -> None:
    opened = state.opened
    payload = {
        "session": opened.session,
        "subject": opened.subject,
        "observer": opened.observer,
        "participant_number": opened.participant_number,
        "protocol": {"name": state.protocol.name, "hash": opened.protocol_hash, "locked": opened.protocol_locked},
        "device": asdict(opened.device),
        "equalizer": opened.equalizer,
        "begun_utc": opened.utc,
        "closed": state.closed,
        "runs": [
            {"index": r.index, "phase": r.phase.value, "frequency_hz": r.frequency_hz, "practice": r.practice}
            for r in state.runs
        ],
        "answers": state.answers,
        "presentations": len(state.trials),
    }
    provenance = gather_provenance(
        protocol_hash=opened.protocol_hash, seeds={"session": opened.seed}, parents=[folder.log]
    )
    write_json(folder.path / SUMMARY_NAME, SUMMARY_FORMAT, SUMMARY_VERSION, payload, provenance, overwrite=True)
