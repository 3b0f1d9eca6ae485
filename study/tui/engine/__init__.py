"""The engine process, which runs sessions and analyses, and the pipe to it: slow work never blocks the screen.

In the screen's process, `client` starts the engine (`child_process`) and reads its messages. The pipe carries values:
`to_engine` and `from_engine`. In the engine's process: `engine` -> `screen_link` (its end of the pipe) ->
`engine_commands` (performs commands), with `remote_display` as the display of a running session. `watch_feed` starts a
separate process for the experimenter's view. Used by `study.tui.app` and `study.cli`. Begin at `engine_commands.py`.
"""
