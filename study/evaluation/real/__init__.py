"""Evaluation on folders of real recordings: diagnose each, diagnose injected faults in a blind test, write one report.

`real_recordings` runs: `real_folder` (inventory) -> `reuse_answers` (of an earlier run), `diagnose_real` (one
recording) -> `injected_halves` (intact half, half with a fault) -> `inject_real` (seal, diagnose, reveal) ->
`write_real` (HTML page, tables); `real_summary`: lines for the terminal. Used by `study.cli.real` (`hapteq real`).
Begin at `real_recordings.py`.
"""
