"""View of a running session for an experimenter, computed from its log and its live state.

`live_state`, `requests` (exchanged between session and watcher) -> `followed_session`, `followed_trials` ->
`watch_alarms` -> `make_watch_view`, which makes a `watch_view`. Used by `study.workflows.views.watch_session` and
`study.tui.watch`. Begin at `make_watch_view.py`.
"""
