"""Use cases of the commands and screens: functions over ports, from a whole sitting to the validation of a single file.

Folders, in the order in which data pass: `planning` (power) -> `checks` (set-up) -> `recording` (play, import) ->
`equalizer` (models, forces) -> `session` (a sitting) with `trial` (a stimulus and its answer) -> `results` (session
logs to tables and analysis). `views` only reads sessions; `diagnosis` finds missing physics from recordings; `files`
validates files. Shared by several: `device_settings`, `output_paths`, `picture_files`, `crash_guard`,
`ignored_interrupts`, and parallel execution (`run_on_executor` on `worker_processes` or a `cluster`; `forked_map`).
Used by `study.cli`, `study.tui.engine` and `study.evaluation`. Begin at `session/conduct_session.py`,
`equalizer/identify_model.py` or `diagnosis/diagnose_recordings.py`.
"""
