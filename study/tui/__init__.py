"""Text user interface. Screens contain no rules of the study: they turn views into words, and keys into replies.

Data pass from `engine` (the process that runs sessions, and the pipe to it) to `app` (the process that draws, and
chooses the screen), then to `screens` (one per file), which consist of `widgets` and `drawing`. `keys` interprets key
presses; replies return through the pipe. `line_mode` is the same interface in plain sentences, `watch` the
experimenter's view of a running session; modules at this level are shared, except `web_server` (`hapteq serve`). Used
by `study.cli`. Begin at `app/app.py` and `engine/engine_commands.py`.
"""
