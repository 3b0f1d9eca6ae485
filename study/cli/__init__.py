"""The command line: one file per command, light to import.

`main` (errors to words and exit codes) -> `command_table` (which command is which file) -> one file a command.
Beside them, shared by several: `session_options`, `seed`, `scheduler` (options), `conduct` (a sitting in line mode),
`motion_notice` (before a real device moves), `screen` (whether there is one), `progress`, `results` (what is printed).
Begin at `main.py`.
"""
