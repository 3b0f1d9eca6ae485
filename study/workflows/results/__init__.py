"""Results of session logs: the state rebuilt from a log, tables, and the analysis of one or many sessions.

`fold_session` (events.jsonl -> state) -> `session_results` (seal, tables and summary of a session) ->
`collect_sessions` (which sessions may be analysed together) -> `analyze_data` (thresholds, statistics, figures,
report) or `export_study` (datasets for other tools). `write_results` does all of this for one session. Begin at
`fold_session.py`.
"""
