"""Whether installation, computer and device are fit for a study.

`examine_setup` runs all checks: `check_installation`, `check_device`, `check_timing` (compared with the empty loop in C
of `bare_loop`), `computer_load`, and `daily_check` (excitation compared with that of the acceptance, by
`device_changes`). Used by `study.cli.doctor` (`hapteq doctor`) and, before a sitting, by
`study.workflows.session.prepare_sitting`. Begin at `examine_setup.py`.
"""
