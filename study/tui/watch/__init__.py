"""The experimenter's view of a running session, as a screen and as lines of text. The screen can also send a stop, a
pause or a note.

Views pass from `watch_source` (port that provides them) -> `watch_words` (texts) -> `watch_panels`, `level_history`
(panels, staircase) -> `watch_screen`, which is opened by `watch_app` (in a second terminal: `hapteq watch`) or
`watch_controller` (in the application itself). `watch_lines` prints the same texts as lines (`hapteq watch --plain`).
Used by `study.cli.watch` and `study.tui.app`. Begin at `watch_screen.py`.
"""
