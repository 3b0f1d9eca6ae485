"""Write the results of one session, at its end or on request: seal, tables, summary, then its own analysis."""

from study.store.sessions.archive import SessionFolder
from study.workflows.results.analysis_files import ANALYSIS_NAME
from study.workflows.results.session_results import write_tables
from study.workflows.results.written_analysis import WrittenAnalysis


def write_results(folder: SessionFolder) -> WrittenAnalysis:
    """Write seal, tables, summary and analysis into the session's folder; returns the analysis. Raises StudyError."""
    # Imported here: statistics and plots load slowly, and beginning or checking a session must not wait for them.
    from study.workflows.results.analyze_data import analyze_data

    write_tables(folder)
    return analyze_data(folder.path, folder.path / ANALYSIS_NAME)
