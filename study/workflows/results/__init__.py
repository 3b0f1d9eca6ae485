"""Results of session logs: the state rebuilt from a log, tables, and the analysis of one or many sessions.

`fold_session` (events.jsonl -> state) -> `session_results` (seal, tables and summary of a session) ->
`collect_sessions` (which sessions may be analysed together; `collected_trials`) -> `analyze_data` (thresholds,
statistics, figures, report: `written_analysis`, `analysis_files`) or `export_study` (datasets for other tools).
`write_results` does the first two steps and the analysis for one session; `session_drift` evaluates its probes. Used by
`study.workflows.session` and `study.cli`. Begin at `fold_session.py`.
"""
