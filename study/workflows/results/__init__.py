"""Results of session logs: the folded state, tables, and the analysis of one or many sessions.

`fold_session` (events.jsonl -> state) -> `session_results` (seal, tables, report of one session) -> `collect_sessions`
(which sessions may be analysed together) -> `analyze_data` (thresholds, statistics, figures, report). Begin at
`fold_session.py`.
"""
