"""The application: a process that draws and takes keys, and leaves all work to the engine.

`app_start` (what the command line asks) -> `app` -> `engine_line` (messages out and in) -> `sitting_screens`,
`asked_screens` (what the engine asks now) or `archive_screens` (start, past sessions) -> `outcomes`. Begin at
`app.py`.
"""
