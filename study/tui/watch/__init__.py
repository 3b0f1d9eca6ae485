"""The experimenter's view of a running session, as a screen and as lines.

`watch_source` (the port) -> `watch_words` -> `watch_screen` with `watch_panels` and `level_history`, shown by
`watch_app` (a second terminal) or `watch_in_app` (the application itself); `watch_lines` for `--plain`. Begin at
`watch_screen.py`.
"""
