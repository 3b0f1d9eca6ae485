"""Contents of a data folder as values for command line and screen. Read only, except notes and requests to a session.

`view_home` (all sessions) -> `session_line`, `session_facts` -> `view_session` (one session); `view_diagnosis` shows a
diagnosis document, `plan_study` which participants are finished and which come next. `watch_session` follows a running
session; `send_request` and `take_note` send it requests. `stream_session` and `stream_signals` stream it over the lab
streaming layer (`lsl_outlets`). Used by `study.cli` and `study.tui.engine`. Begin at `view_home.py`.
"""
