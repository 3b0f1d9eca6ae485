"""Command line of hapteq: one file per command, each imported only when its command is called.

`main` (runs a command; errors to messages and exit codes) -> `command_table` (which command is in which file) -> the
file of the command, which calls `study.workflows`, `study.evaluation` or `study.tui`. Shared by several commands:
`session_options`, `seed`, `scheduler` (options), `conduct` (a sitting without the full-screen interface), `screen`
(starts that interface), `motion_notice` (before a real device moves), `progress` (bars), `results` (output, `--json`).
Used by the launcher of `hapteq`. Begin at `main.py`.
"""
