"""Contents of a data folder as values for command line and screen. Read only, except requests to a running session.

`list_sessions` -> `session_line`, `session_facts` -> `view_session`; `view_diagnosis` for a diagnosis document;
`plan_study` for who is done in a study and who comes next.
`watch_session` follows a running session; `send_request` and `take_note` send it requests. Begin at `list_sessions.py`.
"""
