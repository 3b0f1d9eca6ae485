"""A running session as an experimenter follows it, from its log and its live state.

`live_state`, `requests` (exchanged between session and watcher) -> `followed_session`, `followed_trials` ->
`watch_alarms` -> `make_watch_view`, which makes a `watch_view`. Begin at `make_watch_view.py`.
"""
