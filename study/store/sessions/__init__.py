"""The data folder: one folder per session, and the files in it.

`archive` (paths of the sessions) -> `session_lock` (a single writer) -> `event_log` (append, fsync, then act) ->
`log_seal`, `session_summary`, `trial_recordings` (derived from the log, or written with it). While a session runs:
`live_file`, `request_inbox`, `log_lock`. To erase a session: `withdrawal_files`, `written_elsewhere`. Used by
`study.workflows` and `study.cli`. Begin at `event_log.py`.
"""
