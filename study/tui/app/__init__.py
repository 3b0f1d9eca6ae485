"""The application: a process that draws and reads keys, and leaves all work to the engine.

`app_start` (options of the command line) -> `app` -> `engine_line` (messages out and in) -> `sitting_screens` (what the
engine asks now) or `archive_screens` (start, past sessions) -> `outcomes`. Begin at `app.py`.
"""
