"""Diagnosis of recordings or of a session: reads the input, finds the physics that a model lacks, writes a result
folder.

`diagnosis_input` (`session_references`, `join_session_trials`; `clean_recordings`) -> `diagnose_recordings` (without a
given model: `fit_without_model`) -> `write_diagnosis` and `diagnosed_summary` -> `effect_file` (a discovered law as an
effect of the user); `diagnose_at_screen` does this for the application. Models alone: `fit_first_model`
(`hapteq model`), `write_twin` with `twin_calibration` and `twin_summary` (`hapteq twin`). Used by `study.cli`,
`study.tui.engine` and `study.evaluation.real`. Begin at `diagnose_recordings.py`.
"""
