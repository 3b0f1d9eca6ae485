"""The application: the process that draws screens and reads keys, and leaves all other work to the engine process.

`start_options` (options of the command line) -> `app` -> `engine_connection` (messages to and from the engine) ->
`sitting_screens` (during a sitting) or `archive_screens` (start screen, past sessions, diagnoses) -> `outcomes` (end of
a sitting). `app_commands` is the command palette, `load_screens` imports screens in advance. Used by `study.cli.screen`
(`hapteq study`, `hapteq resume`). Begin at `app.py`.
"""
