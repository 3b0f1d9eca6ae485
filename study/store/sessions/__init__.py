"""The data folder: one folder per session, and what lies in it.

`archive` (where sessions lie) -> `session_lock` -> `event_log` (append, fsync, then act) -> `log_seal`,
`session_summary`, `trial_recordings`; `live_file` and `request_inbox` while a session runs; `withdrawal_files` and
`written_elsewhere` for erasing it. Begin at `event_log.py`.
"""
