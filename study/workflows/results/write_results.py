"""All results of one session: its seal and tables, then the analysis of it alone."""

from study.store.sessions.archive import SessionFolder
from study.workflows.results.analysis_files import ANALYSIS_NAME
from study.workflows.results.session_results import write_tables
from study.workflows.results.written_analysis import WrittenAnalysis


def write_results(folder: SessionFolder) -> WrittenAnalysis:
    """Write the tables and the analysis of this session. Raises StudyError."""
    # Statistics and plots are slow to import; beginning or checking a session does not wait for them.
    from study.workflows.results.analyze_data import analyze_data

    write_tables(folder)
    return analyze_data(folder.path, folder.path / ANALYSIS_NAME)
