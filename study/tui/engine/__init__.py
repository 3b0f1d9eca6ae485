"""The engine process and the pipe to it, so that slow work never blocks the screen.

At the screen: `client` starts the process (`child_process`) and reads its messages. Through the pipe, values only:
`to_engine` and `from_engine`. In the process: `engine` -> `screen_link` (its end of the pipe) -> `engine_commands`
(what is done for the screen), with `remote_display` as the display of a running session. `watch_feed` is a process of
its own for the experimenter's view. Begin at `engine_commands.py`.
"""
