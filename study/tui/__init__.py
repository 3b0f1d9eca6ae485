"""User interface. Screens contain no rules: they turn views into words and keys into replies.

`engine` (the process that does all work, and the pipe to it) -> `app` (the process that draws: which screen is shown)
-> `screens` (one file each) -> `widgets` and `drawing`. `line_mode` is the same in plain sentences, `watch` the
experimenter's view, `keys` the meaning of key presses. Begin at `app/app.py` and `engine/engine_commands.py`.
"""
